// See l1_network.c.
#include "pmsis.h"

#include "airtouch_stream.h"
#include "l1_models.h"

#define AIRTOUCH_MODEL_CONST PI_CL_L1
#define airtouchStream gap8L1Stream
#define airtouchStreamQuantisation gap8L1StreamQuantisation
#define airtouchStreamDecoder gap8L1StreamDecoder
#define airtouchStreamMotion gap8L1StreamMotion
#include "airtouch_stream.c"
