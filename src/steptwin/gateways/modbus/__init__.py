"""``[gateway.modbus]``: several Modbus masters over TCP at real devices (docs/gateways.md)."""
