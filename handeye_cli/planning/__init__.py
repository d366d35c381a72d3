"""Planning past the paper's circle: prediction, limits of a real cell, optimal stations, the way.

`views` describes places of the camera by six numbers, `cell` says which of them are allowed,
`prediction` what they are worth, `settle` moves stations to allowed places, `design` chooses the
best ones, `next_best` adds to what was recorded and `travel` orders the visits.
"""
