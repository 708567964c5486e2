"""The gateway: options from its table, and the face that is wanted."""

from __future__ import annotations

import asyncio
import os
import ssl
from collections.abc import Callable, Mapping
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from steptwin.controller import SECOND
from steptwin.errors import Misuse
from steptwin.gateways.contract import GatewayState, GatewaySubject
from steptwin.gateways.mqtt.connection import Broker, BrokerConnection
from steptwin.gateways.mqtt.jsoncommands import Doorkeeper, JsonCommands
from steptwin.gateways.mqtt.jsonface import JsonFace
from steptwin.gateways.mqtt.jsontopics import Topics
from steptwin.gateways.mqtt.options import MqttSpec, SparkplugSpec
from steptwin.gateways.mqtt.sparkplug import SparkplugFace
from steptwin.gateways.mqtt.sparkplugmetrics import Namespace, rows_of
from steptwin.gateways.points import registers_by_controller
from steptwin.gateways.sampling import Sampler
from steptwin.inputfiles import read_bytes
from steptwin.simulation.toml.addresses import parse_address
from steptwin.system import reason
from steptwin.textcodec import decode


class MqttGateway:
    """Shows ``subject`` to the broker that ``spec`` names. A `Gateway`."""

    protocol = "MQTT"

    def __init__(self, spec: MqttSpec, subject: GatewaySubject, folder: Path) -> None:
        self._spec = spec
        self._folder = folder
        self._subject = subject
        self._sampler: Sampler | None = None
        self._face: JsonFace | SparkplugFace | None = None
        self._shown = 0
        self._connection: BrokerConnection | None = None

    async def open(self, *, listen_any: bool, notice: Callable[[str], None]) -> Mapping[str, object]:
        """The broker need not be there yet: it is looked for until the gateway is closed."""
        spec = self._spec
        broker = broker_of(spec, self._folder)
        door = Doorkeeper(spec, self._folder)
        registers = registers_by_controller("[gateway.mqtt]", spec.registers, self._subject.description)
        self._sampler = Sampler(self._subject.samples, registers, spec.interval)
        if spec.sparkplug is None:
            topics = Topics(spec.topic, spec.file, self._subject.description, registers)
            topic = topics.base
            self._shown = sum(len(group.points) for groups in topics.groups.values() for group in groups)
            commands = JsonCommands(self._subject, door, asyncio.get_running_loop().time)
            self._face = JsonFace(spec, self._subject, topics, self._sampler, commands)
        else:
            topic = f"spBv1.0/{spec.sparkplug.group}/+/{spec.sparkplug.node}/#"
            self._face = self._edge_node(spec.sparkplug, registers, door)
        self._connection = BrokerConnection(broker, self._face, notice)
        if isinstance(self._face, SparkplugFace):
            self._face.start(self._connection.fail)
        self._connection.start()
        host, port = broker.address
        url = f"{'mqtt' if broker.tls is None else 'mqtts'}://{broker.address}"
        return {"host": host, "port": port, "url": url, "topic": topic}

    def _edge_node(self, spec: SparkplugSpec, registers: Mapping[str, list[str]], door: Doorkeeper) -> SparkplugFace:
        if self._sampler is None:
            raise AssertionError
        rows = rows_of(self._subject.description, registers)
        self._shown = sum(len(metrics) for metrics in rows.values())
        return SparkplugFace(
            Namespace(spec.group, spec.node, spec.host),
            rows,
            self._subject,
            self._sampler,
            replace(door.anybody, place="MQTT, Sparkplug B"),
            interval=self._spec.interval,
            store=self._spec.store,
        )

    def state(self) -> GatewayState:
        """A broker does not tell who reads."""
        trouble = "closed" if self._connection is None else self._connection.trouble
        return GatewayState(is_up=trouble is None, text=trouble or "connected", shown=self._shown)

    async def close(self) -> None:
        if self._connection is not None:
            await self._connection.close()
        for one in (self._face, self._sampler):
            if one is not None:
                one.close()


make = MqttGateway


def broker_of(spec: MqttSpec, folder: Path) -> Broker:
    """Raises `Misuse` for files and variables that cannot be used."""
    if spec.tls:
        _tls(spec, folder)
    return Broker(
        address=parse_address(spec.broker, listen_any=True),
        keep_alive_s=spec.keep_alive // SECOND,
        user=spec.user,
        password=_password(spec, folder),
        tls=partial(_valid_tls, spec, folder) if spec.tls else None,
    )


def _password(spec: MqttSpec, folder: Path) -> str | None:
    if spec.password_variable is not None:
        found = os.environ.get(spec.password_variable)
        if found is None:
            raise Misuse(f"[gateway.mqtt]: password_variable: the environment has no {spec.password_variable}")
        return found
    if spec.password_file is None:
        return None
    lines = decode(read_bytes(folder / spec.password_file), spec.password_file).text.splitlines()
    if len(lines) != 1 or not lines[0]:
        raise Misuse(f"[gateway.mqtt]: password_file: {spec.password_file} has {len(lines)} lines: expected one, the password")
    return lines[0]


def _tls(spec: MqttSpec, folder: Path) -> ssl.SSLContext:
    try:
        found = ssl.create_default_context(cafile=None if spec.ca is None else str(folder / spec.ca))
    except (OSError, ssl.SSLError) as error:
        raise Misuse(f"[gateway.mqtt]: ca: {spec.ca}: {reason(error)}") from None
    if spec.certificate is not None and spec.its_key is not None:
        try:
            found.load_cert_chain(folder / spec.certificate, folder / spec.its_key, password="")
        except (OSError, ssl.SSLError, ValueError) as error:
            raise Misuse(f"[gateway.mqtt]: {spec.certificate}, {spec.its_key}: {reason(error)}") from None
    return found


def _valid_tls(spec: MqttSpec, folder: Path) -> ssl.SSLContext:
    """For a session that begins. Raises `Misuse` for a certificate that has expired, of which a broker may say nothing."""
    found = _tls(spec, folder)
    if spec.certificate is None:
        return found
    try:
        from cryptography.x509 import load_pem_x509_certificate
    except ImportError:
        return found
    until = load_pem_x509_certificate((folder / spec.certificate).read_bytes()).not_valid_after_utc
    if until <= datetime.now(UTC):
        raise Misuse(f"{spec.certificate} has expired on {until:%Y-%m-%d %H:%M} UTC: renew it")
    return found
