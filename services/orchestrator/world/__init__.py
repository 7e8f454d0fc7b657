"""World state: road users, lights, stops, places to give way, the car's and the weather's condition."""
