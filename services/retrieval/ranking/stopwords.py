"""Words too common to be searched, by language. Negations, directions and numbers are kept: in law they matter."""

_LISTS = {
    "en": """a an and are as at be been being by can could did do does for from had has have how i if in is it its may me might my of
        on or shall should so some such than that the their them then there these they this those to was we were what when where
        which while who whom whose why will with would you your""",
    "de": """aber als also am an auch auf aus bei beim bis da das dass dem den denn der des die dies diese dieser dieses doch du ein
        eine einem einen einer eines er es etwa für gibt hab habe haben hat hatte hier ich ihm ihn ihr ihre im in ist ja jede
        jeder jedes kann kannst können man mein meine mich mir mit muss müssen nach noch nun nur ob oder sein seine sich sie sind so
        soll sollte um und uns vom von war was wenn wer werden wie wieder will wir wird wo zu zum zur""",
    "fr": """à au aux avec c ce ces cet cette d dans de des du elle en est et eux faut il ils j je l la le les leur leurs lui ma mais me
        mes moi mon n ne nos notre nous on ou où par peut peux pour qu que quel quelle quelles quels qui s sa se ses si son sont sur ta
        te tes toi ton tu un une vos votre vous y""",
    "nl": """aan als bij dan dat de der deze die dit door een en er het hij hoe ik in is je kan maar men met mijn moet mag na naar of om
        ook op over te tot u uit van voor waar wat we wel wie wordt worden ze zich zij zijn zo""",
    "pl": """a aby albo ale co czy do dla gdy gdzie i ich ile jak jaka jaki jakie jest jestem jeśli już kiedy kto który która które lub ma
        mam mi mnie mogę może na o od oraz po się są ta tak tam te tej ten to tu w we z za ze że""",
}
STOPWORDS = {language: frozenset(words.split()) for language, words in _LISTS.items()}
