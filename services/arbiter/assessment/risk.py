"""The paper's risk and utilities."""

import msgspec

from services.arbiter.profiles.profile import Profile


class Utilities(msgspec.Struct, frozen=True, kw_only=True):
    """U_act, U_speak and what lies between them."""

    u_act: float
    u_speak: float

    @property
    def margin(self) -> float:
        """U_act - U_speak, to be held against Delta."""
        return self.u_act - self.u_speak


def risk(ttc_s: float | None, rss_viol: bool, h: float, profile: Profile) -> float:
    """r = alpha max(0, (tau - TTC) / tau) + beta rss_viol + gamma h; no TTC: nothing to meet."""
    urgency = 0.0 if ttc_s is None else max(0.0, (profile.tau_s - max(0.0, ttc_s)) / profile.tau_s)
    return profile.alpha * urgency + profile.beta * float(rss_viol) + profile.gamma * min(1.0, max(0.0, h))


def utilities(r: float, profile: Profile) -> Utilities:
    """U_act = r - C_act - C_err; U_speak = B_adv r - C_fat."""
    return Utilities(u_act=r - profile.c_act - profile.c_err, u_speak=profile.b_adv * r - profile.c_fat)
