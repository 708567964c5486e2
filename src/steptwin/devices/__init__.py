"""Devices in a running process, one subject for studio and gateways: connected, polled, reconnected; with a world or without."""
