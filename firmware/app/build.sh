#!/bin/sh
# Builds the STM32 app against a checkout of bitcraze/crazyflie-firmware, in build/firmware, so that no object
# file lands in the sources; the image comes to lie at build/firmware/PLATFORM.bin, or PLATFORM-gap8.bin and the like
# for another configuration. Called by `make firmware`.
# Arguments: the checkout; a configuration of firmware/app; the platform (cf2, cf21bl, bolt: a *_defconfig of the
# firmware); the vehicle (a header of firmware/app/vehicles by name, or by path); NETWORKS, which is "no" where FR-CFAR
# alone will do.
set -eu
base=${1:-}
config=${2:-app-config}
platform=${3:-cf2}
vehicle=${4:-}
networks=${5:-}
out=build/firmware
headers=firmware/app/vehicles

fail() {
  echo "make firmware: $1" >&2
  exit 1
}

names() {
  for path in $1; do basename "$path" .h; done | paste -sd ' ' -
}

# The text of a #define in a generated header.
text_of() {
  sed -n "s/^#define $1 \"\(.*\)\".*/\1/p" "$2"
}

[ -n "$base" ] || fail "say where the firmware's sources are: make firmware CRAZYFLIE_BASE=~/crazyflie-firmware
  git clone --recursive --branch 2026.08 https://github.com/bitcraze/crazyflie-firmware ~/crazyflie-firmware"
[ -f "$base/tools/make/oot.mk" ] || fail "$base is no checkout of bitcraze/crazyflie-firmware (no tools/make/oot.mk)"
[ -f "$base/vendor/FreeRTOS/include/FreeRTOS.h" ] && [ -d "$base/vendor/CMSIS/CMSIS" ] ||
  fail "$base lacks its submodules: git -C $base submodule update --init --recursive"
[ -f "firmware/app/$config" ] || fail "no firmware/app/$config; CONFIG is one of $(names "firmware/app/app-config*")"
[ -f "$base/configs/${platform}_defconfig" ] || fail "the firmware has no configs/${platform}_defconfig"

case "$vehicle:$platform" in
  :cf2) vehicle=crazyflie-2.1-flow ;;
  :cf21bl) vehicle=crazyflie-2.1-brushless ;;
  :*) fail "no vehicle of AirTouch flies $platform: describe it in a .toml file (host/docs/flash.md), then
  airtouch export --vehicle mine.toml && make firmware PLATFORM=$platform VEHICLE=mine CRAZYFLIE_BASE=$base" ;;
esac
header=$vehicle
[ -f "$header" ] || header=$headers/$vehicle.h
[ -f "$header" ] || fail "no $header; VEHICLE is one of $(names "$headers/*.h"), or a header that
  airtouch export --vehicle mine.toml wrote"
name=$(text_of AIRTOUCH_VEHICLE_NAME "$header")
[ -n "$name" ] || fail "$header is no header that \`airtouch export --vehicle\` wrote; of a .toml file it makes one"
flown=$(text_of AIRTOUCH_VEHICLE_PLATFORM "$header")
[ "$flown" = "$platform" ] || fail "$header: $name is flown by platform ${flown:-(none)}, not by $platform"
stream=gap8/model/airtouch_stream.h
if [ "$(text_of AIRTOUCH_VEHICLE_THRUST "$header")" != "$(text_of AIRTOUCH_STREAM_THRUST $stream)" ] &&
  [ "$networks" != no ]; then
  fail "the networks were trained for the thrust curve of $(text_of AIRTOUCH_STREAM_VEHICLE $stream), not of $name,
  and would not detect what they say. NETWORKS=no builds the app all the same: there FR-CFAR runs alone."
fi

command -v arm-none-eabi-gcc > /dev/null ||
  fail "no arm-none-eabi-gcc: apt-get install gcc-arm-none-eabi libnewlib-arm-none-eabi, or docker run bitcraze/builder"
base=$(cd "$base" && pwd)

image=$out/$platform${config#app-config}.bin
mkdir -p "$out"
rm -rf "$out/firmware" "$out/gap8" "$out/image" "$image"
cp -R firmware "$out/"
cp "$header" "$out/firmware/app/src/airtouch_vehicle.h"
mkdir "$out/gap8"
cp -R gap8/kernels gap8/model "$out/gap8/"
# Not PWD: the firmware's makefiles read it, and make does not set it.
cd "$out/firmware/app"
make PWD="$(pwd)" CRAZYFLIE_BASE="$base" CONFIG="$config" "${platform}_defconfig"
make PWD="$(pwd)" CRAZYFLIE_BASE="$base" CONFIG="$config"
cd - > /dev/null
cp "$out/firmware/app/build/$platform.bin" "$image"
echo "$image" > "$out/image"
echo "$image: $platform, $name, $config; \`make flash\` takes it"
