#!/bin/sh
# Builds the GAP8 app with an SDK that is installed here. Called by `make gap8`; arguments: the SDK, and a checkout of
# bitcraze/aideck-gap8-examples. Without the SDK, Bitcraze's Docker image has it: the message below says how.
set -eu
sdk=${1:-}
aideck=${2:-}

fail() {
  echo "make gap8: $1" >&2
  exit 1
}

[ -n "$aideck" ] && [ -f "$aideck/lib/cpx/inc/cpx.h" ] ||
  fail "say where CPX for the GAP8 is: AIDECK=~/aideck-gap8-examples
  git clone https://github.com/bitcraze/aideck-gap8-examples ~/aideck-gap8-examples"
aideck=$(cd "$aideck" && pwd)
[ -n "$sdk" ] && [ -f "$sdk/configs/ai_deck.sh" ] ||
  fail "no GAP8 SDK at GAP_SDK_HOME=$sdk; with Docker, from the root of AirTouch:
  docker run --rm -v \"\$PWD\":/module -v \"$aideck\":/aideck bitcraze/aideck \\
    bash -c 'source /gap_sdk/configs/ai_deck.sh && make -C /module/gap8/app AIDECK=/aideck clean build image'"
command -v bash > /dev/null || fail "the SDK's set-up needs bash"
exec bash -c "source '$sdk/configs/ai_deck.sh' && make -C gap8/app AIDECK='$aideck' clean build image"
