"""Vehicle profiles written from bus descriptions: the commands of `drivemcp can`."""
