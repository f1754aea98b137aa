"""Feasibility of a motion on a robot: dynamics, contact forces, tempo."""
