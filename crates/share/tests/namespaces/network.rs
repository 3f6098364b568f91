//! Network namespaces with cables between them, and what can be wrong with a cable.

use std::process::Command;

/// A namespace for the hub, and one for each agent, with a cable between both.
pub struct Network {
    prefix: String,
    agents: Vec<&'static str>,
}

/// Runs a tool, which has to succeed.
#[track_caller]
pub fn tool(line: &str) {
    let mut words = line.split_whitespace();
    let output = Command::new(words.next().unwrap_or_default()).args(words).output();
    match output {
        Ok(output) if output.status.success() => {}
        Ok(output) => panic!("`{line}`: {}", String::from_utf8_lossy(&output.stderr).trim()),
        Err(error) => {
            panic!("`{line}` can't be run: {error}; this test takes root, and `ip`, `tc` and `nft`")
        }
    }
}

/// The hub's address on an agent's cable.
pub fn address(agent: &str) -> String {
    format!("10.77.{}.1", subnet(agent))
}

/// Agents have cables of their own, so they have networks of their own.
fn subnet(agent: &str) -> usize {
    agent.len() * 10 + usize::from(agent.as_bytes()[0] - b'a')
}

/// A command of this program in a namespace.
pub fn command(prefix: &str, name: &str) -> Command {
    let mut command = Command::new("ip");
    command.args(["netns", "exec", &format!("{prefix}-{name}")]).arg(std::env::current_exe().unwrap());
    command
}

impl Network {
    pub fn new(agents: &[&'static str]) -> Self {
        let prefix = format!("slate{}", std::process::id());
        let network = Self { prefix, agents: agents.into() };
        let prefix = &network.prefix;
        tool(&format!("ip netns add {prefix}-hub"));
        for agent in agents {
            let subnet = subnet(agent);
            tool(&format!("ip netns add {prefix}-{agent}"));
            tool(&format!(
                "ip -n {prefix}-hub link add {agent} type veth peer name hub netns {prefix}-{agent}"
            ));
            tool(&format!("ip -n {prefix}-hub address add 10.77.{subnet}.1/24 dev {agent}"));
            tool(&format!("ip -n {prefix}-{agent} address add 10.77.{subnet}.2/24 dev hub"));
            tool(&format!("ip -n {prefix}-hub link set {agent} up"));
            tool(&format!("ip -n {prefix}-{agent} link set hub up"));
        }
        network
    }

    pub fn prefix(&self) -> &str {
        &self.prefix
    }

    pub fn command(&self, name: &str) -> Command {
        command(&self.prefix, name)
    }
}

impl Drop for Network {
    fn drop(&mut self) {
        for name in self.agents.iter().chain(&["hub"]) {
            // It may not have been made.
            let _ = Command::new("ip").args(["netns", "delete", &format!("{}-{name}", self.prefix)]).output();
        }
    }
}

/// A fault of the cable to an agent, until this is dropped. Only in the hub's namespace.
pub struct Fault {
    mend: String,
}

impl Fault {
    /// Loses so many of a hundred packets, in either direction.
    pub fn loss(agent: &str, percent: u32) -> Self {
        tool("nft add table inet faults");
        for (chain, name) in [("input", "iifname"), ("output", "oifname")] {
            tool(&format!("nft add chain inet faults {chain} {{ type filter hook {chain} priority 0 ; }}"));
            let which =
                if percent < 100 { format!("numgen random mod 100 < {percent}") } else { String::new() };
            tool(&format!("nft add rule inet faults {chain} {name} {agent} {which} drop"));
        }
        Self { mend: "nft delete table inet faults".into() }
    }

    /// Lets nothing through.
    pub fn partition(agent: &str) -> Self {
        Self::loss(agent, 100)
    }

    /// Lets so many kilobits through in a second, to the agent.
    pub fn rate(agent: &str, kilobits: u32) -> Self {
        tool(&format!("tc qdisc add dev {agent} root tbf rate {kilobits}kbit burst 16kb latency 100ms"));
        Self { mend: format!("tc qdisc delete dev {agent} root") }
    }
}

impl Drop for Fault {
    fn drop(&mut self) {
        tool(&self.mend);
    }
}
