"""What the MOA sets assume, measured on the running body: how the ZMP follows its command, and with what feedback."""
