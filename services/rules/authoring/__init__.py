"""For whoever writes rulepacks: the commands of `drivemcp rulepack`."""
