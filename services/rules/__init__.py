"""What the law says here: typed rulepacks, limits, signs and right of way, each answer with its citations."""
