"""Pictures of one episode: the video with its overlay and captions, and the figure of time series and phase plane."""
