"""The behaviour lock: what the stack decides, sees and says, compared tick by tick with what it did before.

- `logs/`: per log the inputs and answers of each tick (`inputs.jsonl.gz`), and what was decided from them (`outcomes.jsonl.gz`).
- `drives/`: what three rendered lockstep drives published.
- `lock.json`: a digest of each of these outcomes. A run of the evaluation is keyed by this file.
"""
