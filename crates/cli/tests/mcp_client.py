"""Calls tools of `slate mcp` by the client of the protocol's own library: ROLE, and calls as JSON on stdin."""

import asyncio
import json
import sys

from mcp import ClientSession, StdioServerParameters
from mcp.client.stdio import stdio_client


def told(result):
    return {"error": bool(result.is_error), "text": "".join(part.text for part in result.content)}


async def main():
    program, folder, sockets, role = sys.argv[1:]
    server = StdioServerParameters(
        command=program, args=["mcp", "--role", role], cwd=folder, env={"XDG_RUNTIME_DIR": sockets}
    )
    async with stdio_client(server) as (read, write), ClientSession(read, write) as session:
        begun = await session.initialize()
        tools = (await session.list_tools()).tools
        calls = [told(await session.call_tool(name, arguments)) for name, arguments in json.load(sys.stdin)]
    schemas = {tool.name: tool.input_schema for tool in tools}
    print(json.dumps({"server": begun.server_info.name, "tools": schemas, "calls": calls}))


asyncio.run(main())
