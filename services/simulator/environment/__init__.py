"""Weather, the state of the road's surface, and the scenery beside the road."""
