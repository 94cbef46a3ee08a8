"""The processors that flight code runs on: how to compile for each and how to emulate it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Core:
    """One processor."""

    name: str
    gcc: str                     #: the cross compiler of distributions, used only where asked for or alone
    gcc_flags: tuple[str, ...]
    zig_flags: tuple[str, ...]
    has_fpu: bool                #: floats are passed in and returned from float registers
    registers: int               #: integer registers that carry arguments


CORTEX_M4 = Core(
    "cortex-m4", "arm-none-eabi-gcc",
    ("-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"),
    # Without vfp4d16sp this target silently calls soft-float routines.
    ("-target", "thumb-freestanding-eabihf", "-mcpu=cortex_m4+vfp4d16sp"),
    has_fpu=True, registers=4)

#: GAP8's fabric controller and cluster without their extensions
RV32IMC = Core(
    "rv32imc", "riscv64-unknown-elf-gcc",
    ("-march=rv32imc_zicsr", "-mabi=ilp32", "-msmall-data-limit=0"),
    ("-target", "riscv32-freestanding", "-mcpu=generic_rv32+m+c", "-mabi=ilp32", "-msmall-data-limit=0"),
    has_fpu=False, registers=8)

#: A core of GAP8's cluster under CORE-V's encoding of XPULP, which upstream compilers have; see xpulp.py.
RV32IM_XPULP = Core(
    "rv32im-xpulp", "riscv32-corev-elf-gcc",
    ("-march=rv32im_zicsr_xcvmac_xcvalu_xcvsimd_xcvmem", "-mabi=ilp32", "-msmall-data-limit=0"),
    ("-target", "riscv32-freestanding", "-mcpu=generic_rv32+m+xcvmac+xcvalu+xcvsimd+xcvmem", "-mabi=ilp32",
     "-msmall-data-limit=0"),
    has_fpu=False, registers=8)

#: cores by name
CORES = {core.name: core for core in (CORTEX_M4, RV32IMC, RV32IM_XPULP)}
