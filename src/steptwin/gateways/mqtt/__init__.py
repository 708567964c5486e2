"""``[gateway.mqtt]``: a client of an MQTT broker, with readable JSON or as an edge node of Sparkplug B (docs/gateways/mqtt.md).

`connection` keeps the connection to the broker, which may go and come back; what is said there is a `connection.Face`: `jsonface`
with `jsontopics`, `jsoncommands` and `homeassistant`, or `sparkplug` with `sparkplugmetrics` and `sparkplugcodec`.
"""
