"""Steps: policies that choose foot, time and foothold, the motion of the swing foot, contact and stance recovery."""
