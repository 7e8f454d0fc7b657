"""The router's access control, generated from the topic and service tables: a service may do what its row says, no more.

Denied by default. Each service is a user of its own; a guest has no user and nothing. Zenoh judges every message twice:
on its way into the router (`ingress`) and out of it (`egress`); a rule below says which way each right needs.
"""

import secrets
from collections.abc import Iterable, Mapping
from typing import Any

from proto.services import RESERVED, ServiceRow
from proto.topics import TOPICS, TRUTH, Topic

EVALUATION = ServiceRow(name="evaluation", extra="", calls=("*",))
"""Watches a drive and reads the truth; only where a drive is evaluated."""


def access_control(
    rows: Iterable[ServiceRow], vehicle: str = "*", *, evaluation: bool = False, certificates: bool = False
) -> dict[str, Any]:
    """Zenoh's `access_control` settings for these services. `vehicle` `*` fits any name of one vehicle per router.

    `certificates`: from another host a user counts only over TLS with the certificate of the same name.
    """
    members = list(rows) + ([EVALUATION] if evaluation else [])
    rules: list[dict[str, Any]] = []
    policies: list[dict[str, Any]] = []
    subjects: list[dict[str, Any]] = []
    for row in members:
        own = [rule for rule in _rules(row, members, f"drivemcp/{vehicle}") if rule["key_exprs"]]
        rules += own
        subjects += (each := _subjects(row.name, certificates))
        policies.append({"rules": [rule["id"] for rule in own], "subjects": [one["id"] for one in each]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


def _subjects(name: str, certificates: bool) -> list[dict[str, Any]]:
    """As what a service comes: by its user; where there are certificates, by user and certificate, or by user from this host."""
    if not certificates:
        return [{"id": name, "usernames": [name]}]
    return [
        {"id": name, "usernames": [name], "link_protocols": ["tls"], "cert_common_names": [name]},
        {"id": f"{name}-here", "usernames": [name], "interfaces": ["lo"], "link_protocols": ["tcp"]},
    ]


def _rules(row: ServiceRow, members: list[ServiceRow], root: str) -> list[dict[str, Any]]:
    publishes = [f"{root}/{_key(topic, row.name)}" for topic in TOPICS if _may(topic.publishers, row.name)]
    reads = [f"{root}/{topic.name.replace('<id>', '*')}" for topic in TOPICS if _reads(row, topic)]
    serves = [f"{root}/tool/{row.name}", *(f"{root}/tool/{row.name}/{tool}" for tool in row.tools)]
    serves.append(f"{root}/step/{row.name}")
    asks = _callable(row, members, root)
    lives = [f"{root}/alive/{row.name}"]
    watches = [f"{root}/alive/*", *(f"{root}/alive/{member.name}" for member in members)]
    return [
        _rule(row, "publish", ["put"], ["ingress"], publishes),
        _rule(row, "know-subscribers", ["declare_subscriber"], ["egress"], publishes),
        _rule(row, "subscribe", ["declare_subscriber"], ["ingress"], reads),
        _rule(row, "receive", ["put"], ["egress"], reads),
        _rule(row, "serve", ["declare_queryable", "reply"], ["ingress"], serves),
        _rule(row, "be-asked", ["query"], ["egress"], serves),
        _rule(row, "ask", ["query"], ["ingress"], asks),
        _rule(row, "know-servers", ["declare_queryable", "reply"], ["egress"], asks),
        _rule(row, "live", ["liveliness_token"], ["ingress"], lives),
        _rule(row, "watch", ["declare_liveliness_subscriber", "liveliness_query"], ["ingress"], watches),
        _rule(row, "see-alive", ["liveliness_token"], ["egress"], watches),
    ]


def _rule(row: ServiceRow, name: str, messages: list[str], flows: list[str], keys: list[str]) -> dict[str, Any]:
    return {
        "id": f"{row.name}-{name}", "permission": "allow", "messages": messages, "flows": flows, "key_exprs": keys,
    }  # fmt: skip


def _key(topic: Topic[Any], service: str) -> str:
    own = topic.publishers == ("*",)  # health, log and calls: a service speaks for itself alone
    return topic.name.replace("<id>", service if own else "*")


def _reads(row: ServiceRow, topic: Topic[Any]) -> bool:
    return _may(topic.readers, row.name) or (topic.name in row.reads and not topic.private and topic.name != TRUTH.name)


def _may(names: tuple[str, ...], service: str) -> bool:
    return "*" in names or service in names


def _callable(row: ServiceRow, members: list[ServiceRow], root: str) -> list[str]:
    servers = [m for m in members if m.name != row.name and ("*" in row.calls or m.name in row.calls)]
    keys = [f"{root}/tool/*"] if "*" in row.calls else []
    for server in servers:
        keys.append(f"{root}/tool/{server.name}")
        keys += [
            f"{root}/tool/{server.name}/{tool}" for tool in server.tools if row.name in RESERVED.get(tool, (row.name,))
        ]
    if row.name in ("simulator", "player"):  # the conductors of lockstep
        keys += [f"{root}/step/{member.name}" for member in members]
    return keys


def make_credentials(rows: Iterable[ServiceRow], *, evaluation: bool = False) -> dict[str, str]:
    """A new random password for every service."""
    names = [row.name for row in rows] + ([EVALUATION.name] if evaluation else [])
    return {name: secrets.token_urlsafe(24) for name in names}


def dictionary(credentials: Mapping[str, str]) -> str:
    """The router's user dictionary."""
    return "".join(f"{name}:{password}\n" for name, password in credentials.items())
