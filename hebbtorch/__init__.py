"""Hebbian plasticity for PyTorch: networks that change their weights as they run.

Each synapse follows the ABCD rule dw = eta (A x y + B x + C y + D), x the activation before and
y the one after it. The rules are parameters, set by evolution or by a gradient; the weights are
state, given to every call and returned anew. Any number of individuals run as one batch, on the
CPU each bit for bit as if it were alone.

>>> import torch, hebbtorch
>>> target = torch.tensor([0.5, -0.5])
>>> net = hebbtorch.HebbianMLP([3, 4, 2], population=(40,))
>>> es = hebbtorch.EvolutionStrategy(net.n_genes, population=40, seed=7)
>>> for generation in range(30):
...     net.set_genomes(es.ask())
...     state = net.initial_state()
...     with torch.no_grad():  # else autograd remembers the whole life
...         for step in range(20):
...             y, state = net(torch.ones(40, 3), state)
...     es.tell(-(y - target).square().sum(-1))
>>> bool(es.best_fitness > -0.01)
True

Source: Ferigo, Iacca, Medvet, Pigozzi, "Evolving Hebbian Learning Rules in Voxel-based Soft
Robots". Equation, section and algorithm numbers in this package are that paper's.
"""

from hebbtorch.ask_tell import AskTell, ranking
from hebbtorch.evolution_strategy import EvolutionStrategy
from hebbtorch.functional.bounds import l2_normalize, max_normalize, minmax_rescale
from hebbtorch.functional.rules import RULES, LearningRule, Rule, abcd_update, bcm
from hebbtorch.genome import Evolvable, GeneBlock
from hebbtorch.linear import HebbianLinear
from hebbtorch.mlp import HebbianMLP
from hebbtorch.module_genes import ModuleGenes
from hebbtorch.monitor import Monitor
from hebbtorch.recurrent import HebbianRNN
from hebbtorch.rule_bank import RuleBank
from hebbtorch.sharing import SHARINGS, RuleGrid, rule_grid
from hebbtorch.state import State
from hebbtorch.stateful import Stateful, keep_local
from hebbtorch.static import StaticMLP, StaticRNN

__version__ = "0.2.0"

__all__ = [
    "RULES",
    "SHARINGS",
    "AskTell",
    "EvolutionStrategy",
    "Evolvable",
    "GeneBlock",
    "HebbianLinear",
    "HebbianMLP",
    "HebbianRNN",
    "LearningRule",
    "ModuleGenes",
    "Monitor",
    "Rule",
    "RuleBank",
    "RuleGrid",
    "State",
    "Stateful",
    "StaticMLP",
    "StaticRNN",
    "abcd_update",
    "bcm",
    "keep_local",
    "l2_normalize",
    "max_normalize",
    "minmax_rescale",
    "ranking",
    "rule_grid",
]
