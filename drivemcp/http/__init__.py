"""What services that answer over HTTP share: limits for clients, tokens, the thread that serves."""
