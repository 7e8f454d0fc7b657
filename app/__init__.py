"""The application: `drivemcp up`, `play`, `replay`, `audit`, `view` and `doctor`."""
