"""The amplitude above which a chain creeps, in four meanings of the word."""
