"""What can be wrong with a rulepack."""

from drivemcp.errors import UserError


class PackError(UserError):
    """A rulepack that cannot be used; the message names file and field."""
