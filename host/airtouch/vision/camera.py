"""The AI-deck's camera, a Himax HM01B0: pinhole, exposure by light, photon and read noise, eight bits.

Pixel size and format are the chip's. Lens, full well, noise and the longest exposure are assumed, as each field says.
"""

from dataclasses import dataclass

import numpy as np

PHOTONS_PER_LUX = 1.1e16  #: photons of 400 to 700 nm in 1 m^2 and 1 s of daylight of 1 lux (54 lux are 1 umol/m^2/s)


@dataclass(frozen=True)
class Camera:
    """A grey camera that looks straight down, its image's x axis forwards."""

    width: int = 324  #: pixels, HM01B0
    height: int = 244
    pixel_m: float = 3.6e-6  #: HM01B0
    focal_px: float = 180.0  #: assumed: 84 degrees across
    f_number: float = 2.8  #: assumed
    efficiency: float = 0.4  #: electrons a photon, lens and fill factor included; assumed
    full_well_e: float = 5000.0  #: assumed
    read_noise_e: float = 8.0  #: rms, assumed
    frame_hz: float = 6.0  #: what the AI-deck sends (the paper, section 7.8)
    longest_s: float = 1.0 / 30.0  #: exposure, of a sensor that runs at 30 frames a second; assumed
    target: float = 0.3  #: share of the full well that the exposure control aims at; assumed

    @property
    def centre(self) -> tuple[float, float]:
        """The pixel straight ahead of the lens, (x, y)."""
        return (self.width - 1) / 2.0, (self.height - 1) / 2.0


def electron_rate(camera: Camera, lux: float, albedo: float = 1.0) -> float:
    """Electrons a second in a pixel that sees a matt surface under so much light: E rho / (4 N^2) on the chip.

    Source: the camera equation of a lens focused far away, e.g. Szeliski, Computer Vision, eq. 2.104.
    """
    on_chip = lux * albedo / (4.0 * camera.f_number ** 2)
    return on_chip * PHOTONS_PER_LUX * camera.pixel_m ** 2 * camera.efficiency


def exposure_s(camera: Camera, lux: float, albedo: float) -> float:
    """What the exposure control chooses for a mean albedo: up to the target, `longest_s` at most."""
    return min(camera.target * camera.full_well_e / electron_rate(camera, lux, albedo), camera.longest_s)


def expose(camera: Camera, albedo: np.ndarray, lux: float, seconds: float, rng: np.random.Generator) -> np.ndarray:
    """An image of 8 bits of a scene's albedo (rows, columns): photon noise, read noise, full well, gain.

    The gain brings the target of a longest exposure in poor light back to the same grey level.
    """
    mean = electron_rate(camera, lux, 1.0) * seconds * albedo
    counted = np.minimum(rng.poisson(mean), camera.full_well_e)
    counted = counted + rng.normal(0.0, camera.read_noise_e, mean.shape)
    gain = camera.target * camera.full_well_e / max(float(mean.mean()), 1.0)
    return np.clip(np.rint(counted * gain * 255.0 / camera.full_well_e), 0, 255).astype(np.uint8)


def blur_px(camera: Camera, speed_mps: float, seconds: float, distance_m: float) -> float:
    """Pixels by which a point at this distance moves during an exposure: v t f / h."""
    return speed_mps * seconds * camera.focal_px / distance_m
