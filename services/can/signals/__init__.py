"""From frames to fields: signals extracted, messages guarded, samples believed or doubted."""
