"""The losses of section 5.2: cross-entropy, and the disturbance-force-informed loss."""

from collections.abc import Callable

#: weight of the disturbance-force loss; no source: the paper leaves lambda to the application (section 5.2), not tuned
DEFAULT_LAMBDA = 0.1


def edge_loss(df_lambda: float = DEFAULT_LAMBDA, class_weights: tuple[float, float] = (1.0, 1.0)) -> Callable:
    """L = L_S + lambda L_F for Keras, one value a window, weighed by its class (beside, over).

    The target is (n, 2): the label y (1 over a platform) and whether the measured
    disturbance force reached the FR-CFAR threshold at the window's last sample,
    `Features.alert`. The prediction is (n, 2) logits; y_hat is the softmax of the second.
    """
    import keras
    from keras import ops

    def loss(target, logits):
        cross_entropy = keras.losses.sparse_categorical_crossentropy(
            ops.cast(target[:, 0], "int32"), logits, from_logits=True)
        predicted = ops.sigmoid(logits[:, 1] - logits[:, 0])
        beside, over = class_weights
        weight = beside + (over - beside) * target[:, 0]
        return weight * (cross_entropy + df_lambda * disturbance_force_loss(target[:, 1], predicted, ops))

    return loss


def disturbance_force_loss(alert, predicted, ops):
    """L_F = exp|y_hat - 1| - 1 where f_w reached its threshold, exp|y_hat| - 1 elsewhere, (n,).

    alert: (n,) 1.0 or 0.0. ops: numpy or keras.ops. Both cases are exp|y_hat - alert| - 1.
    """
    return ops.exp(ops.abs(predicted - alert)) - 1.0
