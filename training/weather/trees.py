"""Boosted trees as one ONNX graph: every head a column of its output. No library reads scikit-learn's for us at this size."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

BRANCH, LEAF = "BRANCH_LEQ", "LEAF"


def write_trees(path: Path, heads: Mapping[str, Any], features: int) -> None:
    """Write histogram-boosted scikit-learn models (one output each, no categories) as a TreeEnsembleRegressor.

    Input `features` (N, F) float32; output `told` (N, heads): log-odds of classifiers, values of regressors.
    """
    from onnx import TensorProto, checker, helper, save_model

    columns: dict[str, Any] = {name: [] for name in _COLUMNS}
    number = 0
    for target, model in enumerate(heads.values()):
        for (predictor,) in model._predictors:
            _add_tree(columns, predictor.nodes, number, target)
            number += 1
    base = [float(np.ravel(model._baseline_prediction)[0]) for model in heads.values()]
    node = helper.make_node(
        "TreeEnsembleRegressor",
        ["features"],
        ["told"],
        domain="ai.onnx.ml",
        n_targets=len(heads),
        base_values=base,
        **columns,
    )
    graph = helper.make_graph(
        [node],
        "weather",
        [helper.make_tensor_value_info("features", TensorProto.FLOAT, [None, features])],
        [helper.make_tensor_value_info("told", TensorProto.FLOAT, [None, len(heads)])],
    )
    model_proto = helper.make_model(
        graph, opset_imports=[helper.make_opsetid("", 17), helper.make_opsetid("ai.onnx.ml", 3)], ir_version=8
    )
    checker.check_model(model_proto)
    save_model(model_proto, str(path))


_COLUMNS = (
    "nodes_treeids", "nodes_nodeids", "nodes_featureids", "nodes_values", "nodes_modes", "nodes_truenodeids",
    "nodes_falsenodeids", "target_treeids", "target_nodeids", "target_ids", "target_weights",
)  # fmt: skip


def _add_tree(columns: dict[str, Any], nodes: NDArray[Any], tree: int, target: int) -> None:
    for index, node in enumerate(nodes):
        leaf = bool(node["is_leaf"])
        columns["nodes_treeids"].append(tree)
        columns["nodes_nodeids"].append(index)
        columns["nodes_featureids"].append(0 if leaf else int(node["feature_idx"]))
        columns["nodes_values"].append(0.0 if leaf else _below(float(node["num_threshold"])))
        columns["nodes_modes"].append(LEAF if leaf else BRANCH)
        columns["nodes_truenodeids"].append(0 if leaf else int(node["left"]))
        columns["nodes_falsenodeids"].append(0 if leaf else int(node["right"]))
        if leaf:
            columns["target_treeids"].append(tree)
            columns["target_nodeids"].append(index)
            columns["target_ids"].append(target)
            columns["target_weights"].append(float(node["value"]))


def _below(threshold: float) -> float:
    """The largest float32 that is not above the threshold, so that `<=` decides as it did in double precision."""
    single = np.float32(threshold)
    return float(single if float(single) <= threshold else np.nextafter(single, np.float32(-np.inf)))
