"""``[gateway.prometheus]``: metrics, health and readiness over HTTP (docs/gateways/prometheus.md)."""
