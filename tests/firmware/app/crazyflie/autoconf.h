// The configuration comes from the compiler's command line.
#pragma once
