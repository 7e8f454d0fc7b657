"""Permission for the simulated car to be braked, so that ACT acts. What it permits is code that drives, and so part of a run's key."""

import base64
import hashlib
from datetime import UTC, datetime
from pathlib import Path

import msgspec
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

from drivemcp.runtime.grants import LONGEST, KeyPair, sign_grant
from evaluation.run.spec import RunSpec
from proto.decision import Grant
from proto.topics import BRAKE

GRANT = Grant(
    grant_id="evaluation", vehicle="ego", capability=BRAKE.name, max_deceleration_mps2=4.0, max_duration_s=2.0,
    issued_at="", expires_at="",
)  # fmt: skip
"""What the paper's tables are driven with: soft braking. Each run's grant is for the day from its start."""
EMERGENCY = msgspec.structs.replace(
    GRANT, grant_id="evaluation-emergency", envelope="emergency", max_deceleration_mps2=6.5, max_duration_s=20.0
)
"""What the field's table is driven with (`drivemcp evaluate guard`)."""


def granted(spec: RunSpec, folder: Path, grant: Grant = GRANT) -> RunSpec:
    """The spec with the permission; where the grant lies is no part of a run's key."""
    file, pair = folder / "grant.json", _pair()
    now = datetime.now(UTC)
    ours = msgspec.structs.replace(grant, issued_at=now.isoformat(), expires_at=(now + LONGEST).isoformat())
    file.write_bytes(msgspec.json.encode(sign_grant(ours, pair.private)))
    arbiter = {**spec.settings.get("arbiter", {}), "grant_file": str(file), "trusted_keys": [pair.public]}
    return msgspec.structs.replace(spec, settings={**spec.settings, "arbiter": arbiter})


def _pair() -> KeyPair:
    """The same for all simulated cars, so that runs come out alike; no other car trusts it."""
    key = Ed25519PrivateKey.from_private_bytes(hashlib.sha256(b"the simulated cars of the evaluation").digest())
    halves = key.private_bytes_raw(), key.public_key().public_bytes_raw()
    return KeyPair(*(base64.b64encode(half).decode() for half in halves))
