"""Is the law right? Every rulepack's cases, and situations written from the law without looking at the packs."""
