//! Protocol, on stdin and stdout.

use std::sync::Arc;

use rmcp::model::{
    CallToolRequestParams, CallToolResponse, CallToolResult, ContentBlock, Implementation, ListToolsResult,
    PaginatedRequestParams, ServerCapabilities, ServerConfig, Tool, ToolAnnotations,
};
use rmcp::service::RequestContext;
use rmcp::{ErrorData, RoleServer, ServerHandler, ServiceExt};

use super::agent::AgentAccess;
use super::tools;
use crate::failure::Failure;

/// Serves until stdin ends.
pub fn serve(access: AgentAccess) -> Result<bool, Failure> {
    let help = "a program for language models starts `slate mcp`, see book page 30";
    let failed = |reason: String| Failure::Mcp { reason, help: help.into() };
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(|error| failed(error.to_string()))?;
    let access = Arc::new(access);
    let served = Arc::clone(&access);
    let done = runtime.block_on(async {
        let service = ModelServer(served).serve(rmcp::transport::stdio()).await;
        let service = service.map_err(|error| failed(error.to_string()))?;
        service.waiting().await.map_err(|error| failed(error.to_string()))
    });
    access.end();
    // A drive that is under way ends within a step; other requests end with the process.
    runtime.shutdown_timeout(std::time::Duration::from_secs(1));
    done.map(|_| true)
}

/// Server that a model talks to.
pub(super) struct ModelServer(pub Arc<AgentAccess>);

impl ServerHandler for ModelServer {
    fn get_info(&self) -> ServerConfig {
        let instructions = format!(
            "The robot agent `{}`, for {}. Its properties are at URLs: `properties` lists them, `read` reads one. Numbers \
             are in SI units, times in nanoseconds. `stop` stops all actuators at once, whatever else runs; it \
             is no emergency stop.",
            self.0.name(),
            self.0.role().with_article()
        );
        let mut server = ServerConfig::new(ServerCapabilities::builder().enable_tools().build());
        server.server_info = Implementation::new("slate", env!("CARGO_PKG_VERSION"));
        server.with_instructions(instructions)
    }

    async fn list_tools(
        &self,
        _: Option<PaginatedRequestParams>,
        _: RequestContext<RoleServer>,
    ) -> Result<ListToolsResult, ErrorData> {
        Ok(ListToolsResult::with_all_items(tools::of(self.0.role()).into_iter().map(tool).collect()))
    }

    async fn call_tool(
        &self,
        request: CallToolRequestParams,
        context: RequestContext<RoleServer>,
    ) -> Result<CallToolResponse, ErrorData> {
        let access = Arc::clone(&self.0);
        let called = tokio::task::spawn_blocking(move || {
            let arguments = request.arguments.unwrap_or_default();
            access.call(&request.name, &arguments, || context.ct.is_cancelled())
        });
        let result = match called.await {
            Ok(Ok(value)) => CallToolResult::success(vec![ContentBlock::text(value.to_string())]),
            Ok(Err(problem)) => CallToolResult::error(vec![ContentBlock::text(problem)]),
            Err(error) => CallToolResult::error(vec![ContentBlock::text(error.to_string())]),
        };
        Ok(result.into())
    }
}

fn tool(described: tools::ToolEntry) -> Tool {
    let hints = ToolAnnotations::new().read_only(described.reads_only);
    Tool::new(described.name, described.doc, described.schema).with_annotations(hints)
}
