"""brushgs beside other painters of the same views: `brushgs bench --peers`, from a checkout.

A peer is a class or function here and a row of `registry.PEERS`. Each paints in a process of its own, from
the scene file to the picture, so that its seconds and memory are those of a whole command. `run` holds the
protocol, `columns` the figures; `plateau` and `detail` are two studies of brushgs alone.
"""
