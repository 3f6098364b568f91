"""Calls tools of `slate mcp` by the client of the protocol's own library, with calls as JSON on stdin.

`stdio PROGRAM FOLDER SOCKETS ROLE` starts the program; `http URL TOKEN` asks one that runs.
"""

import asyncio
import json
import sys

import httpx2
from mcp import ClientSession, StdioServerParameters
from mcp.client.stdio import stdio_client
from mcp.client.streamable_http import streamable_http_client


def told(result):
    return {"error": bool(result.is_error), "text": "".join(part.text for part in result.content)}


def transport(way, *arguments):
    if way == "http":
        url, token = arguments
        client = httpx2.AsyncClient(headers={"Authorization": f"Bearer {token}"}, timeout=30)
        return streamable_http_client(url, http_client=client)
    program, folder, sockets, role = arguments
    server = StdioServerParameters(
        command=program, args=["mcp", "--role", role], cwd=folder, env={"XDG_RUNTIME_DIR": sockets}
    )
    return stdio_client(server)


async def main():
    async with transport(*sys.argv[1:]) as (read, write), ClientSession(read, write) as session:
        begun = await session.initialize()
        tools = (await session.list_tools()).tools
        calls = [told(await session.call_tool(name, arguments)) for name, arguments in json.load(sys.stdin)]
    schemas = {tool.name: tool.input_schema for tool in tools}
    print(json.dumps({"server": begun.server_info.name, "tools": schemas, "calls": calls}))


asyncio.run(main())
