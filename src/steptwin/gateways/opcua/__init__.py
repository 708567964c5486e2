"""``[gateway.opcua]``: an OPC UA server, with axes as clients of machine tools and robots expect them (docs/gateways/opcua.md).

`addressspace` has the nodes, `session` what they read and write, `notifications` the events,
`security` users and certificates.
What the library (asyncua) cannot do is not announced: conditions of alarms are variables and events.
"""
