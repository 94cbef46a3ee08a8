"""The emulated image: the objects that `make firmware` compiled, linked anew around a board of ours (hardware/).

Nothing of the firmware is compiled a second time. The linker puts the board's functions in place of those in WRAPPED,
moves the CCM behind the RAM (QEMU's STM32F405 has none at its own place), and adds the two words that the
bootloader has in front of the firmware.
"""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

from airtouch.errors import AirTouchError

ROOT = Path(__file__).resolve().parents[2]  #: of the checkout
FIRMWARE = ROOT / "build" / "firmware"  #: what `make firmware` built
OUT = ROOT / "build" / "emulate"  #: the board's objects and the image
RELEASE = "2026.08"  #: the one that the board was written for
#: how to get the firmware's sources
CLONE = (f"git clone --recursive --branch {RELEASE} https://github.com/bitcraze/crazyflie-firmware "
         "~/crazyflie-firmware")
#: functions of drivers, whose place the board's take
WRAPPED = (
    "SystemInit", "usecTimerInit", "usecTimestamp", "uartslkInit", "uartslkTest",
    "uartslkGetPacketBlocking", "uartslkSendDataDmaBlocking", "uart2Init", "uart2GetData", "uart2GetDataWithTimeout",
    "uart2SendData", "eepromInit", "eepromTest", "eepromTestConnection", "eepromReadBuffer", "eepromWriteBuffer",
    "bmi088_gyro_init", "bmi088_accel_init", "bmi088_set_gyro_power_mode", "bmi088_set_gyro_meas_conf",
    "bmi088_set_gyro_int_config", "bmi088_accel_switch_control", "bmi088_set_accel_power_mode",
    "bmi088_set_accel_meas_conf", "bmi088_perform_gyro_selftest", "bmi088_get_gyro_data", "bmi088_get_accel_data",
    "bmp3_init", "bmp3_set_sensor_settings", "bmp3_set_op_mode", "bmp3_get_sensor_data", "pmw3901Init",
    "pmw3901ReadMotion", "vl53l1xInit", "VL53L1_StopMeasurement", "VL53L1_StartMeasurement", "VL53L1_SetDistanceMode",
    "VL53L1_SetMeasurementTimingBudgetMicroSeconds", "VL53L1_GetMeasurementDataReady",
    "VL53L1_GetRangingMeasurementData", "consolePutchar", "assertFail", "storeAssertTextData",
    "storeAssertHardfaultData", "EXTI_GetITStatus", "motorsGetRPM", "appMain", "vTaskDelayUntil", "xTaskIncrementTick")
#: functions of hardware that is not there, which do nothing and return 0
LEFT_OUT = ("i2cdevInit", "i2cdevRead", "i2cdevReadReg8", "i2cdevReadReg16", "i2cdevWrite", "i2cdevWriteReg8",
            "i2cdevWriteReg16", "usblinkInit", "adcInit", "buzzerInit", "watchdogInit")
#: the compiler's flags of the STM32F405
CORE = ("-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16")
#: platform -> what the factory writes into the processor for it, by which the firmware knows its board
DEVICES = {"cf2": "0;CF21", "cf21bl": "0;C21B"}
#: where the STM32 keeps its type, number and size, and board.ld does
OWN, BOARDS, PAGE = 0x1FFF7000, 0x08001000, 0x1000


def tools() -> None:
    """AirTouchError where the compiler, QEMU or another tool is missing."""
    for tool, package in (("arm-none-eabi-gcc", "gcc-arm-none-eabi libnewlib-arm-none-eabi"),
                          ("qemu-system-arm", "qemu-system-arm"), ("git", "git"), ("make", "make")):
        if shutil.which(tool) is None:
            raise AirTouchError(f"no {tool}: apt-get install {package}")


def release(base: Path) -> str:
    """The release of a checkout, by its tag; "unknown" where git cannot say."""
    run = subprocess.run(["git", "-C", base, "describe", "--tags", "--always"], capture_output=True, text=True)
    return run.stdout.strip() or "unknown"


def compile_firmware(base: Path, config: str = "app-config", platform: str = "cf2") -> str:
    """`make firmware` of this checkout; what it printed. Another platform than cf2 gets FR-CFAR alone."""
    if not (base / "tools/make/oot.mk").is_file():
        raise AirTouchError(f"{base} is no checkout of bitcraze/crazyflie-firmware (no tools/make/oot.mk): {CLONE}")
    checkout = release(base) if (base / ".git").exists() else "unknown"
    if checkout == "unknown":
        raise AirTouchError(f"{base} does not say which release it is, and the board is written for {RELEASE}: {CLONE}")
    if not re.fullmatch(rf"{RELEASE}(-\d+-g[0-9a-f]+)?", checkout):
        raise AirTouchError(f"{base} is {checkout}, the board is written for {RELEASE}: git -C {base} checkout "
                            f"{RELEASE}")
    if sys.stderr.isatty():
        print(f"compiling the firmware, {platform} with {config}: a minute", file=sys.stderr)
    networks = "" if platform == "cf2" else "no"
    run = subprocess.run(["make", "-C", ROOT, "--no-print-directory", "firmware", f"CRAZYFLIE_BASE={base}",
                          f"CONFIG={config}", f"PLATFORM={platform}", f"NETWORKS={networks}"],
                         capture_output=True, text=True)
    if run.returncode:
        lines = run.stderr.splitlines()
        reasons = [line.removeprefix("make firmware: ") for line in lines if line.startswith("make firmware: ")]
        wrong = [line for line in lines if "error" in line.lower()] or lines or ["it did not say why"]
        raise AirTouchError(reasons[0] if reasons else
                            f"the firmware does not compile: {wrong[0]}; for all of it: make firmware "
                            f"CRAZYFLIE_BASE={base} CONFIG={config} PLATFORM={platform}")
    return run.stdout


def platform() -> str:
    """The platform of the last `make firmware`."""
    image = FIRMWARE / "image"
    if not image.is_file():
        raise AirTouchError("no image is built yet: leave out --built")
    return Path(image.read_text().strip()).stem.split("-")[0]


def _flags() -> tuple[list[str], Path]:
    """How the firmware compiled the app, less what belongs to that file; the checkout."""
    command = (FIRMWARE / "firmware/app/src/.airtouch_app.o.cmd").read_text().splitlines()[0].split(":=", 1)[1].split()
    flags = [word for word in command[1:] if re.match(r"-[IDmf]", word) and "KBUILD_" not in word]
    base = next(word[2:] for word in flags if word.endswith("/src/config"))
    return flags, Path(base).parents[1]


def _objects() -> list[Path]:
    """The objects of the firmware's last link, each for itself: what was joined to built-in.o on the way is taken
    apart, since a name that is defined in the same object cannot be replaced."""
    where = FIRMWARE / "firmware/app/build"

    def parts(path: Path) -> list[Path]:
        """The object files that were linked into one, from the build's command files."""
        if path.name not in ("built-in.o", "firmware"):
            return [path]
        text = (path.parent / f".{path.name}.cmd").read_text().splitlines()[0].split(":=", 1)[1]
        inner = [where / word for word in text.split(" -o ")[0 if path.name == "firmware" else 1].split()
                 if word.endswith(".o")] if " -o " in text else []
        return [part for child in inner if child != path for part in parts(child)]

    return parts(where / "firmware")


def link(needs: str = "") -> Path:
    """The image, from the last `make firmware`. AirTouchError where that lacks an object of the app that is needed."""
    device = f'-DDEVICE="{DEVICES[platform()]}"'
    if needs and not (FIRMWARE / f"firmware/app/src/{needs}.o").is_file():
        raise AirTouchError(f"the image that was built last is without {needs}.c: leave out --built")
    flags, base = _flags()
    OUT.mkdir(parents=True, exist_ok=True)
    here = Path(__file__).parent
    nothing = OUT / "left_out.c"
    nothing.write_text("".join(f"int __wrap_{name}(void) {{ return 0; }}\n" for name in LEFT_OUT))
    sources = [*sorted((here / "hardware").glob("*.c")), nothing]
    own_objects = [OUT / f"{source.stem}.o" for source in sources]
    for source, target in zip(sources, own_objects, strict=True):
        _run("arm-none-eabi-gcc", *flags, device, "-std=gnu11", "-O2", "-g", "-Wall", "-Werror", "-c", source,
             "-o", target)
    elf = OUT / "board.elf"
    objects = _objects()
    own = ["estimatorEnqueue"] if any(path.name == "height_port.o" for path in objects) else []  # firmware/app/Makefile
    wraps = [f"-Wl,--wrap={name}" for name in (*WRAPPED, *LEFT_OUT, *own)]
    listed = OUT / "objects"
    listed.write_text("\n".join(f'"{path}"' for path in [*own_objects, *objects]))
    _run("arm-none-eabi-gcc", *CORE, "--specs=nosys.specs", "--specs=nano.specs", "-nostdlib", "-z", "noexecstack",
         "-Wl,--gc-sections,--undefined=uxTopUsedPriority,--undefined=boot", f"-L{base}/tools/make/F405/linker",
         "-T", here / "board.ld", *wraps, f"@{listed}", "-lm", "-o", elf)
    _own_number(elf)
    return elf


def _own_number(elf: Path) -> None:
    """Let every word that points to where the STM32 keeps its number point to the board's."""
    data = bytearray(elf.read_bytes())
    words = np.frombuffer(data, "<u4", len(data) // 4)
    own = (words >= OWN) & (words < OWN + PAGE)
    if not own.any():
        raise AirTouchError("the image does not read the processor's number: is it of another release?")
    words[own] += np.uint32(BOARDS - OWN & 0xFFFFFFFF)
    elf.write_bytes(data)


def _run(*command: object) -> None:
    """Run a command. Raises AirTouchError with its errors if it fails."""
    run = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if run.returncode:
        raise AirTouchError(f"{command[0]}: {run.stderr[-3000:]}")
