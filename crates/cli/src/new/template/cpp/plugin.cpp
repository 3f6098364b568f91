// The plugin; its modules are in headers, so that tests have them too.

#include "MODULE_KIND.hpp"

SLATE_MODULES(MODULE_KIND, "0.1.0", Follower);
