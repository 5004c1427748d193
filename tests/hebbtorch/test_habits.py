"""What users of PyTorch do with modules: hooks, autocast, export, copies, processes, types."""

import copy
import io
import os
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
import torch
from torch import nn
from torch.optim.swa_utils import AveragedModel

import hebbtorch

EVERYTHING = {"rule": "bcm", "average": 3, "every": 2, "trace_decay": 0.5, "fixed": True}


def seeded(seed):
    return torch.Generator().manual_seed(seed)


def test_forward_hooks_fire_on_every_plastic_layer():
    net, seen = hebbtorch.HebbianMLP([3, 4, 2]), []
    for layer in net.layers:
        layer.register_forward_hook(lambda module, args, output: seen.append(module))
    net(torch.rand(3))
    assert seen == list(net.layers)


def test_autocast_around_a_plastic_network():
    net, linear = hebbtorch.HebbianMLP([3, 4, 2]), nn.Linear(3, 3)
    with torch.autocast("cpu", dtype=torch.bfloat16):
        x = linear(torch.rand(5, 3))
        assert x.dtype == torch.bfloat16
        y, state = net(x)
        y, state = net(x, state)
    assert y.dtype == state.weights[0].dtype == torch.float32
    torch.testing.assert_close(y, net(x.float(), net(x.float())[1])[0])


@pytest.mark.parametrize("options", [{}, EVERYTHING], ids=["plain", "everything"])
def test_exported_programs_can_be_saved_and_loaded(options):
    net = hebbtorch.HebbianMLP([3, 4, 2], population=(2,), **options)
    x, state = torch.rand(2, 3), net.initial_state()
    file = io.BytesIO()
    torch.export.save(torch.export.export(net, (x, state)), file)
    file.seek(0)
    y, after = torch.export.load(file).module()(x, state)
    expected_y, expected = net(x, state)
    assert isinstance(after, hebbtorch.State)
    torch.testing.assert_close(y, expected_y)
    torch.testing.assert_close(after.weights, expected.weights)


def test_copies_and_averages_after_a_forward_with_gradients():
    layer = hebbtorch.Stateful(hebbtorch.HebbianMLP([3, 4, 2], **EVERYTHING))
    layer(torch.rand(3))
    twin = copy.deepcopy(layer)
    assert torch.equal(twin.weights_0, layer.weights_0)
    assert layer.weights_0.requires_grad
    assert not twin.weights_0.requires_grad
    averaged = AveragedModel(layer)
    layer(torch.rand(3))
    averaged.update_parameters(layer)
    assert averaged(torch.rand(3)).shape == (2,)


def test_training_after_inference_mode():
    layer = hebbtorch.Stateful(hebbtorch.HebbianMLP([3, 4, 2], trace_decay=0.5))
    with torch.inference_mode():
        layer(torch.rand(3))
    layer(torch.rand(3))
    layer(torch.rand(3)).sum().backward()
    assert layer.network.layers[0].rules.D.grad is not None
    with torch.inference_mode():
        layer(torch.rand(3))
    layer.detach()
    layer(torch.rand(3))
    layer(torch.rand(3)).sum().backward()


def test_memory_is_part_of_a_stateful_networks_state_dict():
    layer, other = (
        hebbtorch.Stateful(hebbtorch.HebbianMLP([3, 2], rule="bcm", average=2)) for _ in range(2)
    )
    for _ in range(3):
        layer(torch.rand(3))
    assert {"theta_0", "step_0", "pre_window_0"} <= set(layer.state_dict())
    other.load_state_dict(layer.state_dict())
    x = torch.rand(3)
    assert torch.equal(other(x), layer(x))
    layer.state = layer.state.freeze()
    before = layer.weights_0
    layer(x)
    assert torch.equal(layer.weights_0, before)


DDP = """
import os, sys, torch, hebbtorch
from torch import nn
import torch.distributed as dist
rank = int(sys.argv[1])
dist.init_process_group("gloo", init_method="file://" + sys.argv[2], rank=rank, world_size=2)
torch.manual_seed(0)
plain = hebbtorch.Stateful(hebbtorch.HebbianLinear(3, 2))
nested = hebbtorch.keep_local(nn.Sequential(nn.Linear(3, 3), copy_ := hebbtorch.Stateful(
    hebbtorch.HebbianLinear(3, 2))))
for model, stateful in ((plain, plain), (nested, copy_)):
    parallel = nn.parallel.DistributedDataParallel(model)
    for step in range(3):
        loss = parallel(torch.full((3,), rank + 1.0)).sum()
    loss.backward()
    mine = stateful.weights_0.detach().contiguous()
    both = [torch.empty_like(mine) for _ in range(2)]
    dist.all_gather(both, mine)
    assert not torch.equal(*both), "the processes share their weights"
    gradient = stateful.network.rules.D.grad
    both = [torch.empty_like(gradient) for _ in range(2)]
    dist.all_gather(both, gradient)
    assert torch.equal(*both), "the gradients were not averaged"
print("both hold", flush=True)  # before PyTorch ends its threads, at which it may abort
dist.destroy_process_group()
"""


def test_processes_of_distributed_data_parallel_keep_their_own_states(tmp_path):
    env = {**os.environ, "OMP_NUM_THREADS": "1", "GLOO_SOCKET_IFNAME": "lo"}
    command = [sys.executable, "-W", "ignore", "-c", DDP]
    ranks = [
        subprocess.Popen(
            [*command, str(r), str(tmp_path / "meet")],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=env,
        )
        for r in range(2)
    ]
    said = [process.communicate(timeout=120) for process in ranks]
    assert [out for out, _ in said] == ["both hold\n", "both hold\n"], said


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({"eta": 0.1}, "eta"),
        ({"normalize": "l2"}, "normalize"),
        ({"sharing": "single"}, "sharing"),
        ({"terms": "ABC"}, "terms"),
        ({"every": 2}, "every"),
        ({"decay": 0.1}, "decay"),
        ({"activation": "identity"}, "activation"),
        ({"rule": "oja"}, "rule"),
    ],
)
def test_parameters_of_other_dynamics_are_refused_and_nothing_is_loaded(options, name):
    net = hebbtorch.HebbianMLP([3, 4, 2])
    before = net.genomes()
    other = hebbtorch.HebbianMLP([3, 4, 2], **options).state_dict()
    with pytest.raises(ValueError, match=f"state_dict: expected {name} = .* got parameters of"):
        net.load_state_dict(other)
    nested = {f"0.{key}": value for key, value in other.items()}
    with pytest.raises(ValueError, match=f"state_dict: expected {name} = "):
        nn.Sequential(net).load_state_dict(nested)
    assert torch.equal(net.genomes(), before)


def test_parameters_without_their_dynamics_load_with_one_warning():
    source, net = hebbtorch.HebbianMLP([3, 4, 2]), hebbtorch.HebbianMLP([3, 4, 2])
    old = {key: value for key, value in source.state_dict().items() if "extra" not in key}
    for _ in range(2):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            net.load_state_dict(old)
        assert len(caught) == 1
        assert "which learning rate, sharing and bounds" in str(caught[0].message)
    assert torch.equal(net.genomes(), source.genomes())


def test_parameters_of_a_newer_format_and_of_another_gain_are_refused():
    static = hebbtorch.StaticMLP([3, 2], gain=30.0)
    with pytest.raises(ValueError, match=r"state_dict: expected gain = 1\.0"):
        hebbtorch.StaticMLP([3, 2]).load_state_dict(static.state_dict())
    newer = b'{"format": 99}'
    state = {**static.state_dict(), "_extra_state": torch.tensor(list(newer), dtype=torch.uint8)}
    with pytest.raises(ValueError, match="state_dict: expected format 1 or older, got 99"):
        static.load_state_dict(state)


def test_state_dicts_survive_a_file_read_safely():
    net = hebbtorch.HebbianMLP([3, 4, 2], sharing="neuron", eta="evolved")
    file = io.BytesIO()
    torch.save(net.state_dict(), file)
    file.seek(0)
    other = hebbtorch.HebbianMLP([3, 4, 2], sharing="neuron", eta="evolved")
    other.load_state_dict(torch.load(file, weights_only=True))
    assert torch.equal(other.genomes(), net.genomes())
    whole = copy.deepcopy(net)
    assert torch.equal(whole.genomes(), net.genomes())


SCRIPT = """
import torch
import hebbtorch
from torch import Tensor

net = hebbtorch.HebbianMLP([3, 4, 2], population=(4,))
y, state = net(torch.rand(4, 3))
y, state = net(torch.rand(4, 3), state, plastic=torch.ones(4, dtype=torch.bool))
weights: tuple[Tensor, ...] = state.weights
reveal_type(net(torch.rand(4, 3), state))
reveal_type(hebbtorch.HebbianLinear(3, 2)(torch.rand(3)))
reveal_type(hebbtorch.StaticMLP([3, 2])(torch.rand(3)))
reveal_type(hebbtorch.HebbianRNN([3, 2, 1])(torch.rand(3)))
a: Tensor = net.layers[0].coefficients().A
"""


def test_a_strictly_typed_script_sees_tensor_and_state(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    root = Path(hebbtorch.__file__).parents[1]
    command = [sys.executable, "-m", "mypy", "--strict", "--follow-imports=silent"]
    command += ["--config-file", "", "--cache-dir", str(root / ".mypy_cache"), str(script)]
    env = {**os.environ, "MYPYPATH": str(root)}
    found = subprocess.run(
        command, capture_output=True, text=True, check=False, cwd=tmp_path, env=env
    )
    assert found.returncode == 0, found.stdout
    types = [line for line in found.stdout.splitlines() if "Revealed type" in line]
    assert len(types) == 4
    assert all("tuple[torch._tensor.Tensor, tuple[" in line for line in types)
    assert all("fallback=hebbtorch.state.State" in line for line in types)


def test_any_module_has_genes():
    net = nn.Sequential(nn.Conv2d(1, 2, 2), nn.BatchNorm2d(2), nn.Flatten(), nn.Linear(2, 1))
    genes = hebbtorch.ModuleGenes(net)
    assert genes.n_genes == sum(p.numel() for p in net.parameters())
    genome = torch.arange(float(genes.n_genes))
    genes.set_genomes(genome)
    assert torch.equal(genes.genomes(), genome)
    assert [b.shape for b in genes.gene_blocks[:2]] == [(2, 1, 2, 2), (2,)]
    some = hebbtorch.ModuleGenes(net, ["3.weight"])
    assert some.n_genes == 2
    leaf = torch.zeros(2, requires_grad=True)
    net.eval()
    torch.func.functional_call(net, some.decode(leaf), (torch.rand(1, 1, 2, 2),)).sum().backward()
    assert (leaf.grad != 0).any()
    with pytest.raises(ValueError, match=r"names: expected some of .* got \['4.weight'\]"):
        hebbtorch.ModuleGenes(net, ["4.weight"])


def test_genes_of_a_replaced_layer_count():
    class Scaled(hebbtorch.HebbianLinear):
        def __init__(self, *args, **options):
            super().__init__(*args, **options)
            self.scale = nn.Parameter(torch.ones(2, 1, 1))

    net = hebbtorch.HebbianMLP([3, 4, 2], population=(2,))
    plain = net.n_genes
    net.layers[1] = Scaled(4, 2, population=(2,))
    assert net.n_genes == plain + 1
    assert net.gene_blocks[-1].name == "scale"
    genomes = torch.arange(2.0 * net.n_genes).reshape(2, -1)
    net.set_genomes(genomes)
    assert net.layers[1].scale.flatten().tolist() == genomes[:, -1].tolist()


def test_gradients_reach_genomes():
    net = hebbtorch.HebbianMLP([3, 4, 2], eta="evolved", population=(5,), init="evolved")
    genomes = torch.rand(5, net.n_genes, requires_grad=True)
    state = None
    for _ in range(3):
        call = (torch.ones(5, 3),) if state is None else (torch.ones(5, 3), state)
        y, state = torch.func.functional_call(net, net.decode(genomes), call)
    y.sum().backward()
    assert (genomes.grad != 0).any(0).all()
    with pytest.raises(ValueError, match="genomes: expected .* genes in the last dimension"):
        net.decode(genomes[:, :-1])
