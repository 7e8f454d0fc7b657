"""SAE J1939: messages, transport and the state of a bus."""
