// The exported source once more, as initialised data of the cluster's L1 instead of constants in L2. Its header comes
// first, since it declares the constants in L2 under their own names.
#include "pmsis.h"

#include "airtouch_model.h"
#include "l1_models.h"

#define AIRTOUCH_MODEL_CONST PI_CL_L1
#define airtouchNetwork gap8L1Network
#include "airtouch_model.c"
