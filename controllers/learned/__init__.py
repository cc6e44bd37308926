"""Trained policies from ONNX files at joint level: terms of the observation, the network, servo targets."""
