"""pdn: client, vehicle simulator and operator console of the perception-driven navigation service."""
