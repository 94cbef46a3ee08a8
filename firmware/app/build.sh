#!/bin/sh
# Builds the STM32 app against a checkout of bitcraze/crazyflie-firmware, in build/firmware, so that no object
# file lands in the sources. Called by `make firmware`; arguments: the checkout, a configuration of firmware/app, and
# the platform (cf2, cf21bl, bolt: a *_defconfig of the firmware).
set -eu
base=${1:-}
config=${2:-app-config}
platform=${3:-cf2}
out=build/firmware

fail() {
  echo "make firmware: $1" >&2
  exit 1
}

[ -n "$base" ] || fail "say where the firmware's sources are: make firmware CRAZYFLIE_BASE=~/crazyflie-firmware
  git clone --recursive --branch 2026.08 https://github.com/bitcraze/crazyflie-firmware ~/crazyflie-firmware"
[ -f "$base/tools/make/oot.mk" ] || fail "$base is no checkout of bitcraze/crazyflie-firmware (no tools/make/oot.mk)"
[ -f "$base/vendor/FreeRTOS/include/FreeRTOS.h" ] && [ -d "$base/vendor/CMSIS/CMSIS" ] ||
  fail "$base lacks its submodules: git -C $base submodule update --init --recursive"
command -v arm-none-eabi-gcc > /dev/null ||
  fail "no arm-none-eabi-gcc: apt-get install gcc-arm-none-eabi libnewlib-arm-none-eabi, or docker run bitcraze/builder"
[ -f "firmware/app/$config" ] || fail "no firmware/app/$config; there are app-config and app-config-tap"
[ -f "$base/configs/${platform}_defconfig" ] || fail "the firmware has no configs/${platform}_defconfig"
base=$(cd "$base" && pwd)

mkdir -p "$out"
rm -rf "$out/firmware" "$out/gap8"
cp -R firmware "$out/"
mkdir "$out/gap8"
cp -R gap8/kernels gap8/model "$out/gap8/"
# Not PWD: the firmware's makefiles read it, and make does not set it.
cd "$out/firmware/app"
make PWD="$(pwd)" CRAZYFLIE_BASE="$base" CONFIG="$config" "${platform}_defconfig"
make PWD="$(pwd)" CRAZYFLIE_BASE="$base" CONFIG="$config"
echo "$out/firmware/app/build/$platform.bin"
