#!/bin/sh
# Run a command before whatever else the machine is busy with, where the kernel lets us; as any other where it does not.
#   preferred.sh COMMAND...    -> the command's exit status
# What the tests on the real clock start stands for other machines: boards with a processor of their own, a vessel's computer.
NICE=-20 # the weight of some eighty processes that nobody prefers

[ "$(nice -n $NICE nice 2>/dev/null)" = "$NICE" ] || exec "$@"

# A kernel that shares out by session first (autogroup) looks at the session's own niceness: that one is set too, and set back.
group=/proc/self/autogroup
was=$(sed 's/.*nice //' $group 2>/dev/null)
trap '[ -z "$was" ] || echo "$was" >$group' EXIT
trap 'exit 130' INT TERM
[ -z "$was" ] || echo $NICE >$group || :
nice -n $NICE "$@"
