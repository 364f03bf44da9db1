"""Fabric tensors: of the void segments and of the contacts."""
