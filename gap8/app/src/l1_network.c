// The exported source once more, as initialised data of the cluster's L1 instead of constants in L2. Headers come
// first: what is `const` in them stays so.
#include "pmsis.h"

#include "airtouch_model.h"
#include "l1_models.h"

#define const PI_CL_L1
#define airtouchNetwork gap8L1Network
#include "airtouch_model.c"
