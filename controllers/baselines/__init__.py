"""What the supervisor is compared with: the paper's fixed reference, the regulator that never steps, the statue."""
