"""Training targets, crops and the network, on small made-up pictures."""

from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from services.perception.detect.centre_point import CLOSER_PX, STRIDE_PX
from training.dataset.shards import CLASSES, WINDOW, Frames
from training.detector.batches import Batch, augmented, batches
from training.detector.targets import STRIDE, Targets, encode

CAR, PEDESTRIAN, SIGN = (CLASSES.index(kind) for kind in ("vehicle", "pedestrian", "sign"))


Rows = np.typing.NDArray[np.float32]


def rows(*objects: tuple[float, ...]) -> Rows:
    return np.array(objects, np.float32).reshape(-1, 6)


def test_heat_peaks_at_the_centre_and_the_sides_there_span_the_box() -> None:
    targets = encode(rows((CAR, 40, 20, 120, 60, 1.0)), 96, 160)
    v, u = np.unravel_index(targets.heat[CAR].argmax(), targets.heat[CAR].shape)
    assert (u, v) == (20, 10)
    assert targets.heat[CAR, v, u] == 1.0
    left, top, right, bottom = targets.sides[:, v, u]
    assert (left + right, top + bottom) == (80.0, 40.0)
    assert u * STRIDE + STRIDE / 2 - left == 40.0


def test_a_hidden_object_masks_its_place_and_teaches_nothing() -> None:
    targets = encode(rows((CAR, 40, 20, 120, 60, 0.3)), 96, 160)
    assert targets.heat.max() == 0.0
    assert targets.weight.max() == 0.0
    assert targets.mask[CAR, 10, 20] == 0.0
    assert targets.mask[SIGN].min() == 1.0


def test_a_small_box_stays_visible_on_a_large_one() -> None:
    targets = encode(rows((CAR, 0, 0, 160, 96, 1.0), (SIGN, 72, 40, 88, 56, 1.0)), 96, 160)
    v, u = np.unravel_index(targets.heat[SIGN].argmax(), targets.heat[SIGN].shape)
    assert targets.sides[:, v, u].sum() == pytest.approx(32.0)


def test_a_sought_object_that_fills_the_picture_is_shown_whole() -> None:
    picture, rng = np.full((360, 640, 3), 90, np.uint8), np.random.default_rng(4)
    light = rows((CLASSES.index("light"), 250, 20, 390, 340, 1.0))
    shown = [augmented(picture, light, (288, 448), rng, CLASSES.index("light"))[1] for _ in range(60)]
    whole = [
        len(objects) and objects[0, 5] >= 0.5 and objects[0, 4] - objects[0, 2] <= 0.8 * 288 + 1.0 for objects in shown
    ]
    assert np.mean(whole) > 0.6


def test_crops_move_boxes_with_the_pixels() -> None:
    picture = np.zeros((360, 640, 3), np.uint8)
    picture[100:140, 200:280] = 255
    rng = np.random.default_rng(1)
    checked = 0
    for _ in range(30):
        crop, objects = augmented(picture, rows((CAR, 200, 100, 280, 140, 1.0)), (288, 448), rng)
        if len(objects) and objects[0, 5] > 0.9:
            bright = np.argwhere(crop.astype(int).sum(axis=2) > 300)
            (top, left), (bottom, right) = bright.min(axis=0), bright.max(axis=0) + 1
            assert [left, top, right, bottom] == pytest.approx(objects[0, 1:5].tolist(), abs=3)
            checked += 1
    assert checked > 10


def _shows_person(
    picture: np.typing.NDArray[np.uint8], objects: Rows, rng: np.random.Generator, sought: int | None
) -> bool:
    return bool((augmented(picture, objects, (288, 448), rng, sought)[1][:, 0] == PEDESTRIAN).any())


def test_a_crop_for_the_sake_of_a_class_shows_it() -> None:
    picture = np.zeros((360, 640, 3), np.uint8)
    both = rows((CAR, 20, 300, 80, 340, 1.0), (PEDESTRIAN, 560, 40, 576, 80, 1.0))
    rng = np.random.default_rng(3)
    shown = [_shows_person(picture, both, rng, PEDESTRIAN) for _ in range(60)]
    by_chance = [_shows_person(picture, both, rng, None) for _ in range(60)]
    assert sum(shown) >= 48
    assert sum(shown) > sum(by_chance) + 6
    absent = rows((CAR, 20, 300, 80, 340, 1.0))
    assert augmented(picture, absent, (288, 448), rng, PEDESTRIAN)[0].shape == (288, 448, 3)


@pytest.mark.parametrize("wholes", [0, 2])
def test_a_part_of_a_picture_is_not_enlarged_again_unless_there_is_nothing_else(wholes: int) -> None:
    grey = [np.full((384, 640, 3), 200 if index < wholes else 30, np.uint8) for index in range(6)]
    notes: list[dict[str, str | float]] = [{} if index < wholes else {WINDOW: 1.0} for index in range(6)]
    source, looked = batches(Frames(grey, [rows((SIGN, 300, 180, 340, 220, 1.0))] * 6, notes), 3), 0
    for batch in islice(source, 24):
        if batch.pictures.shape[2:] == CLOSER_PX:
            looked += 1
            assert (np.median(batch.pictures, axis=(1, 2, 3)) > 60).all() == bool(wholes)
    assert looked


def test_pictures_with_signs_are_never_mirrored() -> None:
    picture = np.zeros((360, 640, 3), np.uint8)
    picture[:, :320] = 200
    sign = rows((SIGN, 300, 160, 340, 200, 1.0))
    rng = np.random.default_rng(2)
    for _ in range(40):
        crop, objects = augmented(picture, sign, (288, 448), rng)
        if len(objects):
            light = crop.astype(float).sum(axis=2).mean(axis=0)
            assert light[0] >= light[-1]


def test_the_exported_network_gives_the_boxes_of_the_trained_one(tmp_path: Path) -> None:
    torch = pytest.importorskip("torch", reason="torch is for training only: pip install .[train]")
    pytest.importorskip("onnx", reason="onnx is for training only: pip install .[train]")
    from services.perception.detect.detector import DetectorOptions
    from services.perception.detect.loading import load_detector
    from training.detector.net import STRIDE as TRAINED_STRIDE
    from training.detector.net import DetectorNet, sides_px
    from training.detector.train import export

    assert TRAINED_STRIDE == STRIDE == STRIDE_PX
    torch.manual_seed(0)
    net = DetectorNet(len(CLASSES)).eval()
    torch.nn.init.normal_(net.heat.weight, std=2.0)
    path = tmp_path / "net.onnx"
    export(net, path)
    picture = np.random.default_rng(0).integers(0, 255, (384, 640, 3), dtype=np.uint8)
    with torch.no_grad():
        logits, raw = net(torch.from_numpy(picture.transpose(2, 0, 1)[None].copy()).float())
    found = load_detector(path, DetectorOptions(score_floor=0.0, overlap_limit=1.1)).detect(picture)
    heat = torch.sigmoid(logits)[0].numpy()
    kind, v, u = np.unravel_index(heat.argmax(), heat.shape)
    left, top, right, bottom = sides_px(raw)[0, :, v, u].tolist()
    best = found[0]
    assert best.kind == CLASSES[kind]
    assert best.score == pytest.approx(float(heat.max()), abs=1e-4)
    expected = [
        max(u * 4 + 2 - left, 0),
        max(v * 4 + 2 - top, 0),
        min(u * 4 + 2 + right, 640),
        min(v * 4 + 2 + bottom, 384),
    ]
    assert [best.x0_px, best.y0_px, best.x1_px, best.y1_px] == pytest.approx(expected, abs=0.05)


def test_shards_give_back_what_was_rendered(tmp_path: Path) -> None:
    from services.simulator.render import RendererUnavailable
    from training.dataset.shards import load_frames, render_stage, write_shard

    try:
        renderer, shots = render_stage(None, 5, "train", 1)
    except RendererUnavailable as error:
        pytest.skip(str(error))
    renderer.close()
    write_shard(tmp_path / "train-000005.npz", shots)
    frames: Frames = load_frames(tmp_path, "train")
    assert [note["camera"] for note in frames.notes] == ["front", "tele"]
    assert [picture.shape for picture in frames.pictures] == [(360, 640, 3)] * 2
    assert all((shot.objects == rows_).all() for shot, rows_ in zip(shots, frames.objects, strict=True))
    assert sum(map(len, frames.objects)) > 3
    assert all((rows_[:, 3] > rows_[:, 1]).all() and (rows_[:, 5] <= 1.01).all() for rows_ in frames.objects)


def test_a_grown_network_says_what_the_smaller_one_said() -> None:
    torch = pytest.importorskip("torch", reason="torch is for training only: pip install .[train]")
    from training.detector.net import DetectorNet, grown

    torch.manual_seed(1)
    small, large = DetectorNet(len(CLASSES), (16, 16, 64, 96, 128)).eval(), DetectorNet(len(CLASSES)).eval()
    for layer in small.modules():
        if isinstance(layer, torch.nn.BatchNorm2d):
            torch.nn.init.uniform_(layer.weight, 0.5, 1.5)
            torch.nn.init.uniform_(layer.running_mean, -0.5, 0.5)
    torch.nn.init.normal_(small.heat.weight)
    torch.nn.init.normal_(small.sides.weight)
    weights, taken = grown(large.state_dict(), small.state_dict())
    large.load_state_dict(weights)
    picture = torch.rand(1, 3, 96, 160) * 255
    with torch.no_grad():
        before, after = small(picture), large(picture)
    assert taken == len(small.state_dict())
    assert sum(p.numel() for p in large.parameters()) > sum(p.numel() for p in small.parameters())
    for told, said in zip(after, before, strict=True):
        assert torch.allclose(told, said, atol=1e-3)
        assert float(said.std()) > 0.01


def test_training_goes_on_from_an_exported_network(tmp_path: Path) -> None:
    torch = pytest.importorskip("torch", reason="torch is for training only: pip install .[train]")
    pytest.importorskip("onnx", reason="onnx is for training only: pip install .[train]")
    from training.detector.net import DetectorNet
    from training.detector.start import begin_with_exported
    from training.detector.train import export

    torch.manual_seed(2)
    shipped, further = DetectorNet(len(CLASSES)).eval(), DetectorNet(len(CLASSES))
    for layer in shipped.modules():
        if isinstance(layer, torch.nn.BatchNorm2d):
            torch.nn.init.uniform_(layer.weight, 0.5, 1.5)
            torch.nn.init.uniform_(layer.bias, -0.5, 0.5)
            torch.nn.init.uniform_(layer.running_mean, -0.5, 0.5)
    export(shipped, tmp_path / "net.onnx")
    rng = np.random.default_rng(2)
    seen = [_batch(rng) for _ in range(40)]
    begin_with_exported(further, tmp_path / "net.onnx", iter(seen))
    pictures = torch.from_numpy(seen[0].pictures).float()
    with torch.no_grad():
        expected, told = shipped(pictures), further.eval()(pictures)
        learning = further.train()(pictures)
    for one, other, third in zip(expected, told, learning, strict=True):
        assert torch.allclose(one, other, atol=1e-2)
        assert float((one - third).abs().mean()) < 0.3 * float(one.std())  # its norms are those of the pictures


def test_another_network_is_no_start(tmp_path: Path) -> None:
    pytest.importorskip("torch", reason="torch is for training only: pip install .[train]")
    pytest.importorskip("onnx", reason="onnx is for training only: pip install .[train]")
    from training.detector.net import DetectorNet
    from training.detector.start import begin_with_exported
    from training.detector.train import export

    export(DetectorNet(len(CLASSES), (16, 16, 64, 96, 128)).eval(), tmp_path / "small.onnx")
    with pytest.raises(ValueError, match="not those of this network"):
        begin_with_exported(DetectorNet(len(CLASSES)), tmp_path / "small.onnx", iter(()))


def _batch(rng: np.random.Generator) -> Batch:
    targets = encode(rows(), 64, 96)
    one = Targets(*(getattr(targets, name)[None] for name in ("heat", "mask", "sides", "weight")))
    return Batch(rng.integers(0, 255, (4, 3, 64, 96)).astype(np.uint8), one)
