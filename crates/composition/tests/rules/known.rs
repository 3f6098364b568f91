//! Properties that only Knowledge fills.
#![allow(dead_code, reason = "ports are looked at and never read")]

use slate_composition::{Catalogue, LinkedConfiguration};
use slate_configuration::{Configuration, Options};
use slate_interfaces::Pose2;
use slate_mapek::prelude::*;
use slate_mapek::{analyze, knowledge};
use slate_module::Plugin;
use slate_module::prelude::*;

use super::scene::{allowed, catalogue, check, refused};
use crate::robot::Near;

#[test]
fn rules_of_a_reflex_come_from_knowledge_alone() {
    let says = ["`/r2/avoid/range` can't be set past Knowledge: `/r2/knowledge/rule` has it", "checks them"];
    refused("robots.r2.modules.avoid.inputs.range.distance=-5.0", &says);
    let cut = ["robots.r2.modules.avoid.inputs.range.distance=-5.0", r#"links."r2/avoid/range"=false"#];
    assert!(check(&cut, &catalogue()).unwrap_err().contains(says[0]));
    // Also through an input or a parameter that a person sets.
    let past = ["`/r2/avoid/range", "past Knowledge", "set by hand"];
    refused(r#"links."/r2/avoid/range"="/plain/input""#, &past);
    refused(r#"links."/r2/avoid/range/distance"="/plain/params/gain""#, &past);
    allowed(r#"links."/r2/avoid/range"="/r2/knowledge/rule""#);
    allowed(r#"links."/r2/avoid/range"="/r2/sonar/value""#);
    // A threshold is not a measurement.
    let past = ["`/r2/avoid/range/distance` can't be filled past Knowledge", "of a Sensor"];
    refused(r#"links."/r2/avoid/range/distance"="/r2/sonar/value/distance""#, &past);
}

/// A model of a robot with more in it.
#[interface]
pub struct Model {
    /// Sensors.
    pub robot: RobotModel,
    /// Radius.
    #[unit("m")]
    pub radius: f64,
}

#[ports]
pub struct Models {
    robot: Output<Model>,
}

pub struct Wise;

impl Knowledge for Wise {
    const NAME: &'static str = "wise";
    type Models = Models;
    type Params = ();
    type State = ();

    fn update(_: &mut (), _: &Models, _: &(), _: &Tick) {}
}

#[ports]
pub struct Judging {
    whole: Input<Model>,
    robot: Input<RobotModel>,
    start: Input<Pose2>,
}

pub struct Judge;

impl Analyze for Judge {
    const NAME: &'static str = "judge";
    type Observed = Judging;
    type Params = ();
    type State = ();
    type Value = Near;

    fn process((): &mut (), _: &Judging, (): &(), _: &Tick) -> Option<Near> {
        None
    }
}

const ROBOT: &str =
    "[robots.r2.modules]\nwise = {}\njudge = {}\n[robots.r2.links]\n\"judge/robot\" = \"wise/robot/robot\"\n";

fn with(set: &str) -> Result<(), String> {
    let mut catalogue = Catalogue::default();
    [knowledge::<Wise>(), analyze::<Judge>()]
        .map(Plugin::from)
        .into_iter()
        .for_each(|own| catalogue.add(own));
    let sets = Some(set).filter(|set| !set.is_empty()).map(str::to_owned).into_iter().collect();
    let options = Options { sets, ..Options::default() };
    let configuration = Configuration::from_text("robot.toml", ROBOT, &options).unwrap();
    let linked = LinkedConfiguration::new(&configuration, &catalogue, &|_| false);
    linked.check(&catalogue).map(drop).map_err(|report| report.to_string())
}

#[test]
fn the_robot_model_comes_from_knowledge_alone() {
    with("").unwrap();
    with("robots.r2.modules.judge.inputs.start={x=1.0}").unwrap();
    for set in ["judge.inputs.whole={radius=1.0}", "judge.inputs.robot={pose={x=1.0}}"] {
        let refusal = with(&format!("robots.r2.modules.{set}")).unwrap_err();
        let says = "can't be set past Knowledge: `/r2/wise/robot` has it";
        assert!(refusal.contains("`/r2/judge/") && refusal.contains(says), "{refusal}");
    }
}
