"""A problem whose optimum is known, and a strategy let loose on it."""


def sphere(genomes, optimum):
    return -(genomes - optimum).square().sum(-1)


def evolve(es, generations, optimum=0.0):
    for _ in range(generations):
        es.tell(sphere(es.ask(), optimum))
    return es
