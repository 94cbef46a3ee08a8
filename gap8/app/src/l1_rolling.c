// See l1_network.c.
#include "pmsis.h"

#include "airtouch_rolling.h"
#include "l1_models.h"

#define AIRTOUCH_MODEL_CONST PI_CL_L1
#define airtouchRolling gap8L1Rolling
#define airtouchRollingScale gap8L1RollingScale
#include "airtouch_rolling.c"
