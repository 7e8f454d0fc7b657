"""The field's table: what the guard avoids alone, by scenes of the kind of UN Regulation 152, with an absent driver."""
