"""Finite elements, contact and friction for underplatform dampers."""
