"""Tools for agents, by the Model Context Protocol: operations of REST, the page that a code opens, arms and docs.

Nothing is described or computed here a second time: a tool is an operation of the OpenAPI document, and its call
is a request that the service answers in the same process, with the same limits (:mod:`app.mcp.inside`). The
protocol and its transports are those of the SDK ``mcp``, of the extra ``kinboard[mcp]``. Nothing imports this
package unless an operator or a command asks for it.
"""
