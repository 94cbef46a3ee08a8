"""Sealed sets: flights with withheld effects, made, diagnosed and scored."""
