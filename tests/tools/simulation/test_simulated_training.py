"""The lines of the table of `simulated_training.py`, and the effects whose rows it has."""

from tools.simulation import simulated_training

FIGURES = {"mean_abs_error_m": 0.0412, "missed": 0.125, "false_per_minute": 0.26, "balanced_accuracy": None,
           "lag_s": 0.3, "intervals": {"mean_abs_error_m": (0.03, 0.0555), "missed": None,
                                       "false_per_minute": (0.0, 1.04)}}


def test_a_line_has_each_figure_in_its_unit_with_its_interval():
    assert simulated_training.line("best", "none", FIGURES) == \
        "| best, all on | 0.041 m (0.030 to 0.056) | 12.5 % | 0.3 (0.0 to 1.0) | - | 0.30 s |"
    assert simulated_training.line("paper", "flow_scale", FIGURES).startswith("| paper, `flow_scale` off | 0.041 m")


def test_the_rows_are_the_effects_that_the_scenario_switches_on():
    effects = simulated_training.effects_of("paper-mixed")
    assert "ground_effect" in effects and len(set(effects)) == len(effects)
    assert simulated_training.effects_of("hover") != effects
