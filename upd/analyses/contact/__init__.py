"""The contact of two bodies: a sphere or other curved body pressed and sheared on another, Hertz's
and Mindlin's problem, and a damper's flat faces on its platform, with the contact points of a
dynamic model. Which one it is the recipe declares.
"""
