"""The vehicle simulator: a true world, sensors with noise, and a vehicle that knows only what it measures.

Arrows inside the package, left knows nothing of right::

    se3 <- surface <- scenario <- survey <- world | vehicle, policies <- flight <- remote <- fleet, commands

``world`` holds the truth and ``vehicle`` never imports it: they meet in ``flight`` through the protocols of
``hardware`` (what a vehicle can do and measure) and ``planner`` (what it may ask the service).
"""
