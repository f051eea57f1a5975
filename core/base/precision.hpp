// Precisions in which the core is compiled: always float. Boards without TRICOIL_WHOLE_CORE turn double off, because nothing
// there uses it.
#pragma once

#ifndef TRICOIL_DOUBLE
#define TRICOIL_DOUBLE 1
#endif
