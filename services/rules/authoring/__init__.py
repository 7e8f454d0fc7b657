"""For authors of rulepacks: the commands of `drivemcp rulepack`."""
