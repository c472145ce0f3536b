"""The page on the boat: a process of its own, fed by the status socket, that tells browsers what the vessel does.

It opens the web's socket so that the vessel need not, holds no key, and can do nothing but show, hand on what is keyed, and fail.
"""
