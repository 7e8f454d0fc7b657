"""A kept drive's file says which drive it holds, of a scenario and of a generated place alike."""

from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from evaluation.scenarios import FAMILIES
from studies.modelled_sensors.again import name_of
from studies.tracking.recording import DriveName

PLACES = st.builds(
    "{}/{}/{}".format, st.sampled_from(FAMILIES), st.sampled_from(("calibration", "development")), st.integers(0, 99)
)


@given(
    st.sampled_from(FAMILIES) | PLACES,
    st.integers(0, 10**6),
    st.integers(1, 4000).map(lambda quarters: quarters / 4),
    st.booleans(),
)
def test_the_name_of_a_kept_file_is_read_again(scenario: str, seed: int, seconds: float, cut_ins: bool) -> None:
    drive = DriveName(scenario=scenario, seed=seed, seconds=seconds, cut_ins=cut_ins)
    assert name_of(Path("kept", drive.file)) == drive
