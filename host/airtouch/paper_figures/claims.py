"""The claims of the paper's evaluation, each with its place in the paper's source.

Every number in `values` is in `quote`, and every quote is in its line of `airtouch.tex`. So the transcription can
be checked.
"""

from dataclasses import dataclass

REPRODUCED, NOT_REPRODUCED, UNTESTABLE = "reproduced", "not reproduced", "cannot be tested here"
UNDECIDED = "undecided"  #: the interval is too wide for either answer


@dataclass(frozen=True)
class Claim:
    """A claim: its figure, its content, line and quote of the source, and its numbers in SI units."""

    figure: str
    text: str
    line: int
    quote: str
    values: tuple[float, ...] = ()


CLAIMS = {
    "height-error": Claim("fig8a", "Mean error at abrupt heights is 0.0295 m (30 flights).", 546, "$0.0295$m",
                          (0.0295,)),
    "material-error": Claim("fig8b", "Mean error at material interfaces is 0.0362 m (30 flights).", 546, "$0.0362$m",
                            (0.0362,)),
    "baseline": Claim("fig8c", "Mean error is 0.051 m, the baseline's 0.364 m: 86 % less.", 548,
                      "The mean absolute error is 0.051 m, much lower than the baseline at 0.364m, with $86\\%$",
                      (0.051, 0.364, 0.86)),
    "height-4cm": Claim("fig8d", "At 4 cm nearly 80 % of the errors are within 0.05 m.", 556,
                        "At a height of 4cm, nearly 80\\% of the errors fall within 0.05m", (0.80, 0.05)),
    "height-9cm": Claim("fig8d", "At 9 and 12 cm less than 30 % of the errors are within 0.05 m.", 556,
                        "with the heights of 9cm and 12cm, less than 30\\% of the tests fall within this range",
                        (0.30,)),
    "angle": Claim("fig8e", "Accuracy falls as the approach angle grows from 0 to 20 degrees.", 558,
                   "detection accuracy decreases when the angle increases"),
    "angle-sides": Claim("fig8e", "The side makes no difference: +10 as -10, +20 as -20 degrees.", 558,
                         "The overlap between the curves for +10 and -10 degrees, as well as +20 and -20 degrees"),
    "mat-cement": Claim("fig8f", "Mat to cement is the hardest: median error 0.070 m, greatest 0.170 m.", 562,
                        "with a median error of 0.070 m and a maximum error of 0.170 m", (0.070, 0.170)),
    "water-cement": Claim("fig8f", "Water to cement is the easiest: 75 % of the errors between 0.01 and 0.05 m.", 562,
                          "Approximately $75\\%$ of the data falls within the range of 0.01 m to 0.05 m",
                          (0.75, 0.01, 0.05)),
    "df-loss": Claim("fig8g", "The disturbance-force loss takes 44 % off the errors (0.18 to 0.10 m).", 604,
                     "the majority of errors decreasing from 0.18 m to about 0.10 m. This improvement demonstrates a "
                     "substantial accuracy improvement, reaching 44\\%", (0.18, 0.10, 0.44)),
    "df-epochs": Claim("fig8g", "With it the training converges after 190 epochs, without it after more than 260: "
                       "27 % sooner.", 604, "190 epochs, while without it the model needs more than 260 epochs, "
                       "improved by nearly 27\\%", (190.0, 260.0, 0.27)),
    "resolution": Claim("fig8h", "A higher resolution of FC-FE (window, overlap) gives lower errors.", 606,
                        "higher resolutions enhanced the detection performance"),
    "input-size": Claim("fig8i", "Network inputs of 100 to 170 samples are best.", 608,
                        "the input size ranging from 100 to 170 exhibited the best results", (100.0, 170.0)),
    "size": Claim("sizes", "Pruning and int8 take the model from 141,837 to 14,375 bytes.", 621,
                  "from 141,837 Bytes to 14,375 Bytes", (141837.0, 14375.0)),
    "speed": Claim("sizes", "Inference goes from 2.71 to 1.10 ms.", 621, "from 0.00271s to 0.00110s",
                   (0.00271, 0.00110)),
    "accuracy": Claim("sizes", "Accuracy falls from 97 % to 86 %.", 621, "decreased from $97\\%$ to $86\\%$",
                      (0.97, 0.86)),
    "power": Claim("table1", "The five modules need 121 mW, 43 mW of them for AirTouch.", 645, "Total Power & 121",
                   (121.0,)),
    "negligible": Claim("table1", "Beside the 3000 mW of the propellers that is negligible.", 651,
                        "approximately 3000 mW", (3000.0,)),
    "wind": Claim("wind", "Errors stay the same in steady wind of 0, 0.1, 0.2 and 0.3 m/s.", 656,
                  "remains similar with wind speeds from 0 m/s, 0.1 m/s, 0.2 m/s, and 0.3 m/s", (0.0, 0.1, 0.2, 0.3)),
    "flops": Claim("table2", "0.28 million FLOPs against 3900 million of the vision network.", 672,
                   "3900 million & 0.28 million", (3900e6, 0.28e6)),
    "parameters": Claim("table2", "13 KBytes of parameters against 58 KBytes.", 673, "58KBytes\t& 13KBytes",
                        (58e3, 13e3)),
    "training": Claim("table2", "13 minutes of training against 30.", 674, "30min\t& 13min", (1800.0, 780.0)),
    "memory": Claim("table2", "32 kbit a frame against millions of bits.", 675, "Millions of bits & 32Kbits", (32e3,)),
    "light-airtouch": Claim("fig11b", "AirTouch's error is 0.035 m at any light.", 708,
                            "mean absolute distance errors around 0.035m", (0.035,)),
    "light-bright": Claim("fig11b", "At 100 lux vision is better: 0.012 m.", 708,
                          "At the luminance of 100 lux, vision-based TEED outperforms AirTouch with a mean error of "
                          "around 0.012m", (100.0, 0.012)),
    "light-dark": Claim("fig11b", "At 50 and 20 lux vision is worse than AirTouch.", 708,
                        "at 50 lux and 20 lux luminance, the accuracy decreases to levels worse than AirTouch's",
                        (50.0, 20.0)),
    "network-vision": Claim("fig11c", "Vision's error grows as its network shrinks from 53 KB.", 710,
                            "decreases from its default 53KB, the mean absolute detection error increases", (53e3,)),
    "network-airtouch": Claim("fig11c", "AirTouch gains little from more parameters.", 710,
                              "the accuracy of AirTouch does not increase a lot when more parameters are involved"),
    "backup": Claim("fusion", "AirTouch complements vision as a backup.", 713, "Complement as a backup"),
    "range": Claim("range", "A drone of 2.5 kg, 450 mm and 100 mm propellers senses the ground from about 3 m.", 722,
                   "weighing 2.5 kg with a diagonal span of 450 mm and 100 mm propellers could detect ground effect "
                   "from approximately 3 meters", (2.5, 0.45, 0.1, 3.0)),
    "range-small": Claim("range", "The small drone's sensing is much worse above 12 cm.", 722,
                         "degraded significantly above 12 cm", (0.12,)),
}


def of_figure(figure: str) -> dict[str, Claim]:
    """The claims of a figure: name -> claim."""
    return {name: claim for name, claim in CLAIMS.items() if claim.figure == figure}
