"""Genes for any module of PyTorch: convolutions, norms, recurrent cells, plastic layers inside."""

from __future__ import annotations

from collections.abc import Sequence

from torch import Tensor, nn

from hebbtorch.genome import Evolvable


class ModuleGenes(Evolvable):
    """The parameters of any module as one genome.

    >>> nn = torch.nn
    >>> net = nn.Sequential(nn.Conv1d(1, 2, 3), nn.Flatten(), nn.Linear(4, 1))
    >>> genes = ModuleGenes(net)
    >>> genes.n_genes  # 2 * 3 + 2 + 4 + 1
    13
    >>> genes.set_genomes(torch.zeros(13))  # into the module itself
    >>> population = torch.rand(40, 13)  # or 40 individuals at once, without touching it
    >>> def act(parameters, x):
    ...     return torch.func.functional_call(net, parameters, (x,))
    >>> torch.func.vmap(act)(genes.decode(population), torch.rand(40, 1, 1, 4)).shape
    torch.Size([40, 1, 1])

    Args:
        module: whose parameters they are; those that it uses in several places count once.
        names: full names of the parameters that become genes; None: all.

    Raises:
        ValueError: a name that the module does not have.
    """

    def __init__(self, module: nn.Module, names: Sequence[str] | None = None) -> None:
        super().__init__()
        self.population = ()
        self.module = module
        known = dict(module.named_parameters())
        self.names = list(known) if names is None else list(names)
        if unknown := [name for name in self.names if name not in known]:
            raise ValueError(f"names: expected some of {list(known)}, got {unknown}")

    def gene_parameters(self) -> list[tuple[int, str, nn.Parameter]]:
        """See `Evolvable`; the layer is the parameter's place among the names."""
        return [
            (index, name, self.module.get_parameter(name)) for index, name in enumerate(self.names)
        ]

    def decode(self, genomes: Tensor) -> dict[str, Tensor]:
        """As in `Evolvable`, with the names that they have in the module."""
        return {
            name.removeprefix("module."): genes for name, genes in super().decode(genomes).items()
        }

    def forward(self, *args: object, **kwargs: object) -> object:
        """What the module does."""
        return self.module(*args, **kwargs)
